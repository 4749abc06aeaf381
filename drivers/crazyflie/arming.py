"""Arming and disarming: asked for until the vehicle's own status says so, since a request may be lost."""

from __future__ import annotations

from collections.abc import Callable

from drivers.crazyflie import crtp_wire
from drivers.crazyflie.picture import Picture
from drivers.crazyflie.status import Status
from lcd_flight.model import Clock, RefusedError

ANSWER_NS = 2_000_000_000
REPEAT_NS = 200_000_000
_POLL_NS = 10_000_000

Request = Callable[[bytes], None]


async def arm(picture: Picture, request: Request, protocol: int, clock: Clock) -> None:
    """Make sure that the vehicle is armed; one that arms by itself is waited for.

    Raises:
        RefusedError: it will not, with its reason.
    """
    if picture.status is not None and picture.status.trouble:
        raise RefusedError(f"the vehicle will not arm: {picture.status.trouble}")
    packet = crtp_wire.arming(True, protocol)
    if not await _becomes(picture, Status.ARMED, True, lambda: request(packet), clock):
        raise RefusedError(f"the vehicle will not arm: {_obstacle(picture.status)}")


async def ready_to_fly(picture: Picture, clock: Clock) -> None:
    """Wait for an armed and unlocked vehicle to say that it can fly.

    Raises:
        RefusedError: it does not.
    """
    if not await _becomes(picture, Status.CAN_FLY, True, lambda: None, clock):
        raise RefusedError(f"the vehicle is armed but cannot fly: {_obstacle(picture.status)}")


async def disarm(picture: Picture, request: Request, protocol: int, clock: Clock) -> None:
    """Make sure that a vehicle which is armed on request is not armed any more.

    Raises:
        RefusedError: it stays armed.
    """
    if picture.status is None or Status.AUTO_ARM in picture.status:
        return
    packet = crtp_wire.arming(False, protocol)
    if not await _becomes(picture, Status.ARMED, False, lambda: request(packet), clock):
        raise RefusedError("the vehicle stays armed")


async def _becomes(picture: Picture, bit: Status, wanted: bool, ask: Callable[[], None], clock: Clock) -> bool:
    """Whether a bit of the status is as wanted within the time for an answer, asking again and again."""
    began_ns = asked_ns = clock.now_ns()
    if not _is(picture, bit, wanted):
        ask()
    while not _is(picture, bit, wanted):
        now_ns = clock.now_ns()
        if now_ns - began_ns > ANSWER_NS:
            return False
        if now_ns - asked_ns > REPEAT_NS:
            asked_ns = now_ns
            ask()
        await clock.sleep_until(now_ns + _POLL_NS)
    return True


def _is(picture: Picture, bit: Status, wanted: bool) -> bool:
    return picture.status is not None and (bit in picture.status) is wanted


def _obstacle(status: Status | None) -> str:
    if status is None:
        return "it does not report its status"
    if status.trouble:
        return status.trouble
    return "its own checks have not passed: put it level and still, look at the console of cfclient"
