"""What a flight was worth: figures of merit, the report page, comparisons, series. Reads logs only, plans nothing."""

from lcd_flight.review.compare import write_comparison
from lcd_flight.review.figures import FlightFigures, PhaseFigures, figures_of
from lcd_flight.review.page import write_page
from lcd_flight.review.path_figure import write_path_figure
from lcd_flight.review.rerun_file import write_rerun
from lcd_flight.review.series_file import write_csv, write_parquet

__all__ = [
    "FlightFigures",
    "PhaseFigures",
    "figures_of",
    "write_comparison",
    "write_csv",
    "write_page",
    "write_parquet",
    "write_path_figure",
    "write_rerun",
]
