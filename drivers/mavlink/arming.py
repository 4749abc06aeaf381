"""Into the autopilot's mode, armed, and out again: a command, its acknowledgement, and what the heartbeat then says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivers.mavlink.autopilot import Autopilot
from drivers.mavlink.commands import ACCEPTED, NO_ANSWER, Commands, result_name
from drivers.mavlink.custody import Custody
from drivers.mavlink.dialect import mavlink
from drivers.mavlink.picture import Picture
from drivers.mavlink.waiting import pause, until
from lcd_flight.model import Clock, RefusedError

CONFIRM_S = 1.5
"""For the heartbeat that shows it: one a second at the least."""
LIMIT_S = 3.0
"""What is refused is asked for again each second until then: sensors may still settle, a stream be too young."""
RETRY_S = 1.0
LAND_LIMIT_S = 8.0
"""A vehicle on the ground disarms by itself 2 to 4 s after it was told to land."""
FORCED = 21196.0
_ARM, _SET_MODE = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_DO_SET_MODE


@dataclass(frozen=True, slots=True)
class Controls:
    """What changing its state takes."""

    autopilot: Autopilot
    commands: Commands
    picture: Picture
    clock: Clock

    def reason(self, result: int) -> str:
        """Why it did not do as it was told: the result's name, and its latest complaints in its own words."""
        said = self.picture.texts.recent(self.clock.now_ns())
        return f"{result_name(result)}; the autopilot says {said}" if said else result_name(result)


async def enter_mode(controls: Controls, custody: Custody, mode: int) -> None:
    """Change the mode, and see it changed. A change that was taken is not asked for again: a pilot may have undone it.

    custody: asked before each attempt; a vehicle that is not ours any more is left in its mode.

    Raises:
        RefusedError: it will not, with its reason.
    """
    picture, clock, name = controls.picture, controls.clock, controls.autopilot.mode_name(mode)
    deadline_ns, result = clock.now_ns() + round(LIMIT_S * 1e9), ACCEPTED
    while clock.now_ns() < deadline_ns and custody.is_ours():
        wanted = _while_unchanged(picture, custody)
        result = await controls.commands.ask(_SET_MODE, *controls.autopilot.mode_command(mode), wanted=wanted)
        if result == ACCEPTED and await until(clock, lambda: picture.custom_mode == mode, CONFIRM_S):
            return
        if picture.custom_mode == mode:  # the acknowledgement was lost, the change was not
            return
        if result in (ACCEPTED, NO_ANSWER):
            break
        await pause(clock, RETRY_S)
    if not custody.is_ours():
        raise RefusedError(f"{name} is not asked for any more: {custody.taken_over or 'it was stopped or disarmed'}")
    if result == ACCEPTED:
        now = "none" if picture.custom_mode is None else controls.autopilot.mode_name(picture.custom_mode)
        raise RefusedError(f"the autopilot took the change to {name} but stays in {now}: is a remote control on?")
    raise RefusedError(f"the autopilot refuses {name}: {controls.reason(result)}")


async def arm(controls: Controls) -> None:
    """Arm in the mode that takes setpoints, and see it armed.

    Raises:
        RefusedError: it will not, with its reason.
    """
    picture, clock = controls.picture, controls.clock
    deadline_ns, result = clock.now_ns() + round(LIMIT_S * 1e9), ACCEPTED
    while clock.now_ns() < deadline_ns:
        _require_mode(controls)
        result = await controls.commands.ask(_ARM, 1.0, wanted=lambda: not picture.armed and _has_mode(controls))
        _require_mode(controls)
        if (result == ACCEPTED or picture.armed) and await until(clock, lambda: picture.armed is True, CONFIRM_S):
            return
        if result in (ACCEPTED, NO_ANSWER):
            break
        await pause(clock, RETRY_S)
    if result == ACCEPTED:
        raise RefusedError("the autopilot took the order to arm but stays disarmed: look at its messages")
    raise RefusedError(f"the autopilot will not arm: {controls.reason(result)}")


async def disarm(controls: Controls, custody: Custody) -> None:
    """Disarm on the ground: after a flight by its own LAND mode, else by order; by force where neither helps.

    ArduPilot does not reliably see a touchdown on no thrust, and then refuses an ordinary disarm for seconds.

    custody: asked before each order; somebody else's vehicle is left alone.

    Raises:
        RefusedError: it stays armed.
    """
    picture, clock = controls.picture, controls.clock
    if custody.flown and await _lands(controls, custody):
        return
    result = NO_ANSWER
    for may, forced in ((custody.is_ours, 0.0), (custody.may_be_cut, FORCED)):
        if may():
            result = await controls.commands.ask(_ARM, 0.0, forced, wanted=_while_armed(picture, may))
            if await until(clock, lambda: picture.armed is False, CONFIRM_S):
                return
    if custody.is_ours():
        raise RefusedError(f"the autopilot stays armed: {controls.reason(result)}")


async def land(controls: Controls, custody: Custody) -> bool:
    """Hand over to its LAND mode; whether it is seen in it."""
    try:
        await enter_mode(controls, custody, controls.autopilot.land_mode)
    except RefusedError:
        return False
    return True


def disarm_once(controls: Controls) -> None:
    """One order to disarm, which is refused in the air; nothing is waited for."""
    controls.commands.tell(_ARM, 0.0)


def cut(controls: Controls) -> None:
    """One forced disarm, in the air too; nothing is waited for."""
    controls.commands.tell(_ARM, 0.0, FORCED)


def _while_unchanged(picture: Picture, custody: Custody) -> Callable[[], bool]:
    """True while the mode is the one of now, and the vehicle ours."""
    before = picture.custom_mode
    return lambda: picture.custom_mode == before and custody.is_ours()


def _has_mode(controls: Controls) -> bool:
    return controls.picture.custom_mode == controls.autopilot.flight_mode


def _require_mode(controls: Controls) -> None:
    """Refuse to arm in a mode that somebody else has chosen meanwhile.

    Raises:
        RefusedError: so it is.
    """
    mode, autopilot = controls.picture.custom_mode, controls.autopilot
    if mode is not None and not _has_mode(controls):
        raise RefusedError(f"the mode was changed to {autopilot.mode_name(mode)} while arming: somebody else has it")


def _while_armed(picture: Picture, may: Callable[[], bool]) -> Callable[[], bool]:
    return lambda: picture.armed is True and may()


async def _lands(controls: Controls, custody: Custody) -> bool:
    if controls.picture.armed is False:
        return True
    if not await land(controls, custody):
        return False
    return await until(controls.clock, lambda: controls.picture.armed is False, LAND_LIMIT_S)
