"""The extra `train`: heavy packages that flying does not need, imported on use, with one clear line where missing."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any

from lcd_flight.model import InputError


def _required(module: str, extra: str = "train") -> ModuleType:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        remedy = f"install it with `pip install 'lcd-flight[{extra}]'`"
        raise InputError(f"this needs {package}, which is not installed ({error}); {remedy}") from error


def require_pyarrow() -> tuple[Any, Any]:
    """`pyarrow` and `pyarrow.parquet`.

    Raises:
        InputError: it is not installed.
    """
    return _required("pyarrow"), _required("pyarrow.parquet")


def require_torch() -> Any:
    """`torch`.

    Raises:
        InputError: it is not installed.
    """
    return _required("torch")


def require_ray() -> Any:
    """`ray`, of the extra `ray`.

    Raises:
        InputError: it is not installed.
    """
    return _required("ray", extra="ray")
