"""Simulated vehicles that other programs connect to, by name: `crazyflie`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Protocol, Self, cast

from lcd_flight.model import LinkContext
from lcd_flight.plugins.entry_points import load


class VehicleServer(Protocol):
    """A simulated vehicle behind a port. Taking the port is `async with`."""

    @property
    def description(self) -> str:
        """What it simulates."""
        ...

    @property
    def uri(self) -> str:
        """Where clients connect to; true once the port is taken."""
        ...

    async def __aenter__(self) -> Self:
        """Take the port.

        Raises:
            RefusedError: it is not to be had.
        """
        ...

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the port back."""
        ...

    async def serve(self, say: Callable[[str], None]) -> None:
        """Live for ever. say: is told what happens to the vehicle, a line at a time."""
        ...


def vehicle_server(name: str, address: str, options: Mapping[str, str], context: LinkContext) -> VehicleServer:
    """The simulated vehicle of that name, to be served at `host:port`.

    Raises:
        InputError: there is no such vehicle, address or option; says which there are.
        RefusedError: a package that it needs is not installed.
    """
    return cast(VehicleServer, load("vehicle_servers", name, "simulated vehicle")(address, options, context))
