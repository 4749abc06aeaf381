"""The end of a flight whose loop has failed: level descent at the control rate, then the motors stop.

It leans on nothing that may have failed: no pose, no control law, no observers.
"""

from __future__ import annotations

from lcd_flight.flight.manoeuvres import blind_setpoint, blind_time_s
from lcd_flight.flight.memory import Memory
from lcd_flight.flight.rate import RateKeeper
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import Clock, Link, Phase
from lcd_flight.model.frames import yaw_of


async def descend_and_stop(link: Link, clock: Clock, setup: FlightSetup, memory: Memory) -> None:
    """From the last known height if it was in the air, at once if it was armed; nothing if it was neither.

    memory: of the last tick that was decided.
    """
    state = memory.state
    if not (memory.phase.airborne or memory.phase is Phase.ARMED):
        return
    try:
        if memory.phase.airborne and state is not None:
            setpoint = blind_setpoint(setup.vehicle, memory.hover_N or setup.vehicle.weight_N, yaw_of(state.q_WB))
            descent_s = blind_time_s(setup.vehicle, state.p_WB[2] - setup.ground_z_m, state.v_WB_W[2])
            end_ns, keeper = clock.now_ns() + round(descent_s * 1e9), RateKeeper(clock)
            while clock.now_ns() < end_ns:
                link.send(setpoint, clock.now_ns())
                await keeper.next()
    finally:
        link.stop_motors()
