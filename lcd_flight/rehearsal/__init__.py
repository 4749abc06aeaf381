"""The mission's own plan flown in batched simulation before arming, with a verdict."""

from lcd_flight.rehearsal.rehearse import rehearse
from lcd_flight.rehearsal.verdict import Rehearsal, Spot

__all__ = ["Rehearsal", "Spot", "rehearse"]
