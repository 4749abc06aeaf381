"""What every pose source does with the bytes that it is brought."""

from __future__ import annotations

from lcd_flight.model import Clock, InputError, PoseListener, PoseOptions, PoseReport
from lcd_flight.wire.mocap_frame import decode, topic
from mocap.pose_filter import FilterState, PoseFilter


class Ingestor:
    """Bytes in, pose reports out: keeps the filter's state and stamps arrivals."""

    def __init__(self, rigid_body: str, clock: Clock, options: PoseOptions) -> None:
        """Prepare to follow one rigid body.

        Raises:
            InputError: not a name for a rigid body.
        """
        try:
            self.topic = topic(rigid_body)
        except ValueError as error:
            raise InputError(f"motion_capture.rigid_body: {error}") from None
        self._clock = clock
        self._filter = PoseFilter(options)
        self._state = FilterState()
        self._listeners: list[PoseListener] = []

    def listen(self, listener: PoseListener) -> None:
        """Tell `listener` of every accepted frame from now on."""
        self._listeners.append(listener)

    def receive(self, data: bytes) -> None:
        """Take in one message that has just arrived; whatever it is, it raises nothing."""
        try:
            frame = decode(data)
        except ValueError as error:
            self._state = self._filter.malformed(self._state, str(error))
        else:
            before = self._state.accepted
            self._state = self._filter.step(self._state, frame, self._clock.now_ns())
            accepted = self._state.accepted
            if accepted is not None and accepted is not before:
                for listener in self._listeners:
                    listener(accepted)

    def report(self, now_ns: int) -> PoseReport:
        """The filtered pose brought forward to `now_ns`, and the health of the source."""
        return self._filter.report(self._state, now_ns)
