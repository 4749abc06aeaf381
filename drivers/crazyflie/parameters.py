"""The parameters that flying needs: set before each flight and read back, since a vehicle with a wrong one flips."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

from drivers.crazyflie.session import Session
from lcd_flight.model import RefusedError

ANSWER_S = 2.0


@dataclass(frozen=True, slots=True)
class Requirement:
    """One parameter."""

    name: str
    value: float
    why: str


REQUIRED = (
    Requirement("stabilizer.estimator", 2, "the Kalman filter, which takes poses"),
    Requirement("stabilizer.controller", 1, "the PID cascade that rehearsals fly"),
    Requirement("flightmode.stabModeRoll", 1, "roll is an angle"),
    Requirement("flightmode.stabModePitch", 1, "pitch is an angle"),
    Requirement("flightmode.stabModeYaw", 1, "yaw is an absolute angle, counter-clockwise"),
    Requirement("locSrv.extPosStdDev", 0.01, "m, how well motion capture knows the position"),
    Requirement("locSrv.extQuatStdDev", 0.0045, "rad, how well it knows the attitude"),
)
"""Names and meanings: crazyflie-firmware 2026.08. `lcd doctor` compares with them."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A parameter that is not as flight needs it."""

    requirement: Requirement
    found: float | None
    """None: the firmware has no such parameter."""


def differences(session: Session) -> tuple[Difference, ...]:
    """What differs now, by the values that connecting has read."""
    found = ((required, value_of(session, required.name)) for required in REQUIRED)
    return tuple(Difference(r, value) for r, value in found if value is None or not _same(value, r.value))


def value_of(session: Session, name: str) -> float | None:
    """The value as it was read or confirmed last; None where there is no such parameter."""
    group, _, variable = name.partition(".")
    text = session.param.values.get(group, {}).get(variable)
    return None if text is None else float(text)


def require(session: Session) -> tuple[str, ...]:
    """Set all that differs and read everything back; returns what was changed, in words. Blocks.

    Raises:
        RefusedError: a parameter that does not exist, does not answer, or does not hold its value.
    """
    changed = [
        f"{d.requirement.name} {'absent' if d.found is None else f'{d.found:g}'} -> {d.requirement.value:g}"
        for d in differences(session)
    ]
    for required in REQUIRED:
        write(session, required.name, required.value)
    return tuple(changed)


def write(session: Session, name: str, value: float, *, held: bool = True) -> None:
    """Set one parameter and read it back. Blocks.

    held: False for one that the firmware changes by itself.

    Raises:
        RefusedError: it does not exist, does not answer, or does not hold the value.
    """
    group, _, variable = name.partition(".")
    answered = threading.Event()

    def answer(_name: str, _value: str) -> None:
        answered.set()

    session.param.add_update_callback(group=group, name=variable, cb=answer)
    try:
        session.param.set_value(name, value)
        _await(answered, name)
        session.param.request_param_update(name)
        _await(answered, name)
    except (KeyError, AttributeError) as error:
        raise RefusedError(f"the vehicle's firmware does not let {name} be set ({error}): update it") from error
    finally:
        session.param.remove_update_callback(group=group, name=variable, cb=answer)
    found = value_of(session, name)
    if held and (found is None or not _same(found, value)):
        raise RefusedError(f"parameter {name} was set to {value:g} but reads {found}: restart the vehicle")


def _await(answered: threading.Event, name: str) -> None:
    if not answered.wait(ANSWER_S):
        raise RefusedError(f"the vehicle does not answer for parameter {name}: check the link")
    answered.clear()


def _same(a: float, b: float) -> bool:
    """Equal as far as a float32 can tell."""
    return math.isclose(a, b, rel_tol=1e-5, abs_tol=1e-9)
