"""NumPy's .npz files from users: read without unpickling, and what is wrong is one clear line."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.model import FloatArray, InputError


def read_arrays(path: Path, wanted: str) -> dict[str, Any]:
    """All arrays of the file.

    wanted: what it should hold, for the message.

    Raises:
        InputError: there is no such file, or it is not one of plain arrays.
    """
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            raise InputError(f"{path}: one bare array; save {wanted} together with numpy.savez")
        with loaded as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: not a NumPy .npz file of plain arrays ({error})") from error


def read_array(path: Path, arrays: dict[str, Any], name: str, wanted: str, dimensions: int) -> FloatArray:
    """One of the file's arrays.

    wanted: its shape and unit, for the message.

    Raises:
        InputError: it is missing, has other dimensions, or holds what is not a finite number.
    """
    if name not in arrays:
        found = ", ".join(arrays) or "nothing"
        raise InputError(f"{path}: has no array `{name}` {wanted}; it holds {found}")
    array = arrays[name]
    if array.ndim != dimensions or array.dtype.kind not in "fiub":
        raise InputError(f"{path}: {name} is {array.dtype} of shape {array.shape}; give numbers, {wanted}")
    if not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{path}: {name}{list(place)} is {array[place]}; give finite numbers")
    return np.asarray(array, dtype=np.float64)
