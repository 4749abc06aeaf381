"""Pictures from values: escaped markup, axes and still plots as SVG, in light and dark. Numpy alone."""

from importlib import resources


def colors() -> str:
    """The palette as CSS variables, for pages and for pictures that stand alone."""
    return (resources.files(__name__) / "colors.css").read_text(encoding="utf-8")
