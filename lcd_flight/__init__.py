"""Plans quadrotor trajectories that this vehicle can really fly, flies them at 100 Hz and explains every flight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lcd_flight.api import FlightOptions, FlownMission, PreparedFlight, fly, plan, rehearse, save_plan

__all__ = ["FlightOptions", "FlownMission", "PreparedFlight", "fly", "plan", "rehearse", "save_plan"]


def __getattr__(name: str) -> Any:
    """Import the API on use: `lcd_flight.model` alone must stay cheap."""
    if name in __all__:
        from lcd_flight import api

        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
