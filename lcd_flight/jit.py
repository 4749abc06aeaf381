"""Compile plain functions with numba, cached on disk under a key that covers every source that goes into a kernel.

numba's own cache looks at the kernel's file only, so an edited control law would stay stale in a rehearsal. Here the
cache folder is named by a hash of all the sources given; other versions of the same sources keep their own folder.
numba is imported on first use, so that importing a module of kernels' callers stays cheap.
"""

from __future__ import annotations

import hashlib
import os
import threading
import types
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from lcd_flight.errors import RefusedError

Function = TypeVar("Function", bound=Callable[..., Any])

_ONE_AT_A_TIME = threading.Lock()
"""numba's cache folder is a setting of the whole process: threads must not change it for each other."""

_tell: Callable[[str], None] | None = None
"""Who wants to know of compilations."""


def announce_compilation(tell: Callable[[str], None] | None) -> None:
    """Have `tell` called with a kernel's name whenever one is compiled rather than loaded: that takes seconds."""
    global _tell  # noqa: PLW0603 - numba's listeners are one for the process, too
    _tell = tell


def cache_folder() -> Path:
    """Where this project keeps what it can make again (`LCD_CACHE_DIR`, else `~/.cache/lcd-flight`)."""
    default = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "lcd-flight"
    return Path(os.environ.get("LCD_CACHE_DIR") or default)


class Compiler:
    """Compiles functions whose code depends on the given source files or folders.

    sources: files, or folders of which every `*.py` counts.
    options: passed on to `numba.njit`, e.g. `fastmath=True`.
    """

    def __init__(self, *sources: Path, **options: Any) -> None:
        self._sources = sources
        self._options = options
        self._helpers: dict[Callable[..., Any], Any] = {}
        self._folder: Path | None = None

    def kernel(self, function: Function) -> Function:
        """Compile `function`, caching the machine code on disk; plain functions that it calls are inlined into it."""
        import numba
        from numba.core import config

        with _ONE_AT_A_TIME:
            _listen()
            linked = _relink(function, self._inlined)
            before = config.CACHE_DIR  # type: ignore[attr-defined]
            config.CACHE_DIR = str(self._cache())  # type: ignore[attr-defined]
            try:
                return numba.njit(cache=True, **self._options)(linked)  # type: ignore[no-any-return]
            finally:
                config.CACHE_DIR = before  # type: ignore[attr-defined]

    def _inlined(self, function: Callable[..., Any]) -> Any:
        """A plain function as numba can call it, its own callees first."""
        if function not in self._helpers:
            import numba

            # A loop over vehicles is vectorised only where nothing is called; nobody but kernels calls the helpers.
            inlined = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
            options: dict[str, Any] = {**inlined, **self._options}
            self._helpers[function] = numba.njit(**options)(_relink(function, self._inlined))
        return self._helpers[function]

    def _cache(self) -> Path:
        if self._folder is None:
            folder = cache_folder() / "kernels" / _digest(self._sources)
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                remedy = "set LCD_CACHE_DIR to a folder that can be written to"
                raise RefusedError(f"cannot keep compiled kernels in {folder}: {error.strerror}; {remedy}") from error
            self._folder = folder
        return self._folder


@cache
def _listen() -> None:
    """Hear of what numba compiles, once in a process."""
    from numba.core import event

    class Announcer(event.Listener):
        def on_start(self, event: Any) -> None:
            if _tell is not None:
                _tell(event.data["dispatcher"].py_func.__name__)

        def on_end(self, event: Any) -> None:
            """Nothing is told of the end."""

    event.register("numba:compile", Announcer())  # type: ignore[no-untyped-call]


def _relink(function: Callable[..., Any], replace: Callable[[Callable[..., Any]], Any]) -> types.FunctionType:
    """A copy of `function` whose global plain functions are replaced; the original stays plain Python."""
    assert isinstance(function, types.FunctionType)  # noqa: S101 - narrows the type
    names = function.__code__.co_names
    found = {n: function.__globals__[n] for n in names if isinstance(function.__globals__.get(n), types.FunctionType)}
    if not found:
        return function
    scope = {**function.__globals__, **{n: replace(f) for n, f in found.items()}}
    copy = types.FunctionType(function.__code__, scope, function.__name__, function.__defaults__, function.__closure__)
    copy.__qualname__, copy.__module__ = function.__qualname__, function.__module__
    return copy


def _digest(sources: Iterable[Path]) -> str:
    """A short hash of the text of all sources."""
    sha = hashlib.sha256()
    for source in sources:
        for path in sorted(source.rglob("*.py")) if source.is_dir() else [source]:
            sha.update(path.name.encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()[:16]
