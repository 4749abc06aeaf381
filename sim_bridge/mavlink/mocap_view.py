"""How motion capture sees the vehicle: in our own axes, whose x is east or, where it was set up so, is not."""

from __future__ import annotations

import math

from lcd_flight.model import State, Vector3
from lcd_flight.model.frames import conjugate, from_yaw, multiply, rotate
from sim_bridge.camera import Camera
from sim_bridge.mavlink.options import MavlinkOptions


class MocapView:
    """A camera system whose x axis points `mocap_yaw_deg` counter-clockwise from east, with faults."""

    def __init__(self, options: MavlinkOptions, rigid_body: str, seed: int) -> None:
        self._options = options
        self._camera = Camera(rigid_body, seed, options.noise_mm, options.noise_deg, twist=options.twist)
        self._q_WM = from_yaw(math.radians(options.mocap_yaw_deg))
        self._frozen: State | None = None

    def frame(self, state: State, state_ns: int, now_ns: int, since_s: float | None) -> bytes | None:
        """The next frame; None: a gap. since_s: since the vehicle was armed."""
        if self._is_on(self._options.mocap_gap_s, since_s):
            return None
        if not self._is_on(self._options.mocap_freeze_s, since_s):
            self._frozen = None
        elif self._frozen is None:
            self._frozen = state
        return self._camera.frame(self.seen(self._frozen or state), state_ns, now_ns)

    def seen(self, state: State) -> State:
        """A state in the frame of motion capture."""
        back = conjugate(self._q_WM)
        return State(rotate(back, state.p_WB), rotate(back, state.v_WB_W), multiply(back, state.q_WB), state.w_WB_B)

    def true_place(self, position_m: Vector3) -> Vector3:
        """Where a place that is given in the frame of motion capture truly is."""
        return rotate(self._q_WM, position_m)

    def _is_on(self, at_s: float | None, since_s: float | None) -> bool:
        if at_s is None or since_s is None:
            return False
        return 0.0 <= since_s - at_s < self._options.mocap_fault_ms * 1e-3
