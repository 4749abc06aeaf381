"""Style and script of the report, as files of their own."""

from importlib import resources


def asset(name: str) -> str:
    """The text of one of these files."""
    return (resources.files(__name__) / name).read_text(encoding="utf-8")
