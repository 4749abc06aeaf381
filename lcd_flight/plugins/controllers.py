"""Control laws by name, or out of a user's own file: `my_law.py:command`."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import cast

from lcd_flight.model import AttitudeThrust, ControlLaw, InputError, Reference, State, Vector3, Vehicle
from lcd_flight.plugins.entry_points import load


def controller(name: str) -> ControlLaw:
    """The control law of that name, or the function of a Python file, given as `FILE.py:FUNCTION`.

    Raises:
        InputError: there is no such controller, says which there are; the file cannot be run or lacks the function.
        RefusedError: a package that it needs is not installed.
    """
    file, _, function = name.rpartition(":")
    if not file.endswith(".py"):
        return cast(ControlLaw, load("controllers", name, "controller"))
    law = getattr(_module(Path(file)), function, None)
    if not callable(law):
        raise InputError(f"{file}: has no function {function!r}; a controller is given as FILE.py:FUNCTION")
    return _checked(cast(ControlLaw, law), name)


def _module(path: Path) -> ModuleType:
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: cannot be loaded as Python")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{path}: {type(error).__name__}: {error}") from error
    return module


def _checked(law: ControlLaw, name: str) -> ControlLaw:
    """The same law; what it does wrong is told as an error of the user's file."""

    def command(
        state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
    ) -> tuple[AttitudeThrust, Vector3]:
        try:
            setpoint, held = law(state, reference, vehicle, integral, dt_s)
        except (ArithmeticError, ValueError):
            raise  # numbers that it has no answer for: the tick's business
        except Exception as error:
            raise InputError(f"controller {name}: {type(error).__name__}: {error}") from error
        if not isinstance(setpoint, AttitudeThrust):
            raise InputError(f"controller {name}: gave {setpoint!r}; (AttitudeThrust, integral) is wanted")
        return setpoint, held

    return command
