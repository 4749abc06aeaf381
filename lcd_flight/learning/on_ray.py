"""Parts of the work made on a Ray cluster (the extra `ray`, imported only here).

Every part is a task of its own; Ray gives the tasks of a node that dies to others. This process alone writes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from typing import Any

from lcd_flight.errors import LcdError
from lcd_flight.learning.extras import require_ray
from lcd_flight.learning.spread import Part, Result, Spread
from lcd_flight.model import InputError

_TASKS_AHEAD = 2
"""For each processor of the cluster: under way, or done and not yet written. What bounds the memory."""


def on_ray(address: str) -> Spread:
    """Hand the parts out to the cluster at `address`, e.g. `192.0.2.1:6379`, or `auto` for one on this machine.

    Raises:
        InputError: Ray is not installed.
    """
    ray = require_ray()

    def spread(work: Callable[[Part], Result], parts: Sequence[Part]) -> Generator[tuple[Part, Result], None, None]:
        if not parts:
            return
        _connect(ray, address)
        try:
            yield from _results(ray, work, parts)
        finally:
            ray.shutdown()

    return spread


def _connect(ray: Any, address: str) -> None:
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise InputError(
            f"--ray {address}: no cluster there ({_first_line(error)}); start one with `ray start --head`"
        ) from error


def _results(
    ray: Any, work: Callable[[Part], Result], parts: Sequence[Part]
) -> Generator[tuple[Part, Result], None, None]:
    """Each part with its result, in order; a few tasks are always on their way."""
    task = ray.remote(num_cpus=1, max_retries=-1)(_do)
    shared = ray.put(work)
    ahead = max(1, int(_TASKS_AHEAD * ray.cluster_resources().get("CPU", 1)))
    waiting, pending = deque(parts), deque[tuple[Part, Any]]()
    while waiting or pending:
        while waiting and len(pending) < ahead:
            pending.append((waiting[0], task.remote(shared, waiting.popleft())))
        part, reference = pending.popleft()
        yield part, _fetched(ray, reference)


def _do(work: Callable[[Part], Result], part: Part) -> Result:
    """On the cluster's machine."""
    return work(part)


def _fetched(ray: Any, reference: Any) -> Any:
    """A task's result; our own errors as they were raised there.

    Raises:
        InputError: the cluster failed.
    """
    try:
        return ray.get(reference)
    except ray.exceptions.RayError as error:
        cause = getattr(error, "cause", None)
        if isinstance(cause, LcdError):
            raise cause from error
        remedy = "is lcd-flight installed on each of its machines, in this version?"
        raise InputError(f"the Ray cluster failed ({_first_line(cause or error)}); {remedy}") from error


def _first_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]
