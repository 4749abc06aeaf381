"""What a flight was worth: figures of merit and the report page. Reads logs only, plans nothing."""

from lcd_flight.review.figures import FlightFigures, PhaseFigures, figures_of

__all__ = ["FlightFigures", "PhaseFigures", "figures_of"]
