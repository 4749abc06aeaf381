"""Pose sources and publishers by endpoint: `tcp://127.0.0.1:5555`, `ipc:///run/mocap`, `loopback://name`."""

from __future__ import annotations

from typing import cast

from lcd_flight.model import Clock, InputError, PoseOptions, PosePublisher, PoseSource
from lcd_flight.plugins.entry_points import load, names


def pose_source(endpoint: str, rigid_body: str, clock: Clock, options: PoseOptions | None = None) -> PoseSource:
    """What listens at `endpoint` for one rigid body; listening is `async with`.

    Raises:
        InputError: unknown kind of endpoint (says which there are), or not a name for a rigid body.
    """
    factory = load("pose_sources", _scheme(endpoint, "pose_sources"), "motion capture endpoint")
    return cast(PoseSource, factory(endpoint, rigid_body, clock, options or PoseOptions()))


def pose_publisher(endpoint: str) -> PosePublisher:
    """What publishes frames at `endpoint`.

    Raises:
        InputError: unknown kind of endpoint; says which there are.
        RefusedError: the endpoint is not to be had, e.g. its port is in use.
    """
    factory = load("pose_publishers", _scheme(endpoint, "pose_publishers"), "motion capture endpoint")
    return cast(PosePublisher, factory(endpoint))


def _scheme(endpoint: str, group: str) -> str:
    scheme, separator, _ = endpoint.partition("://")
    if not separator:
        kinds = ", ".join(f"{name}://" for name in names(group))
        raise InputError(f"motion capture endpoint {endpoint!r} is not one such as tcp://HOST:PORT; there are: {kinds}")
    return scheme
