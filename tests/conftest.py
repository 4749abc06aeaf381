"""What every test leaves behind is cleared away."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from lcd_flight import jit


@pytest.fixture(autouse=True)
def _nobody_is_told_of_compilations() -> Iterator[None]:
    """A command's terminal is closed with its test; kernels that are compiled later must not write to it."""
    yield
    jit.announce_compilation(None)
