"""What a flight was worth: figures of merit and the report page. Reads logs only, plans nothing."""

from lcd_flight.review.figures import FlightFigures, PhaseFigures, figures_of
from lcd_flight.review.page import write_page
from lcd_flight.review.path_figure import write_path_figure

__all__ = ["FlightFigures", "PhaseFigures", "figures_of", "write_page", "write_path_figure"]
