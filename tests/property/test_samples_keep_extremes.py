"""However long a flight is and wherever it has gaps: the least and the greatest value are among the samples."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from lcd_flight.model.types import FloatArray
from lcd_flight.review.detail import samples

VALUES = arrays.arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(float("nan")))


@given(VALUES, st.integers(4, 120))
@settings(deadline=None, max_examples=200)
def test_extremes_survive(values: FloatArray, most: int) -> None:
    time_s = np.arange(len(values)) / 100
    times, kept = samples(time_s, values, most)
    assert len(times) == len(kept) <= max(most, 4)
    assert (np.diff(times) >= 0.0).all()
    assert time_s[0] <= times[0]
    assert times[-1] <= time_s[-1]
    known, left = values[np.isfinite(values)], kept[np.isfinite(kept)]
    assert (len(known) == 0) == (len(left) == 0)
    if len(known):
        assert (left.min(), left.max()) == (known.min(), known.max())
        assert np.isin(left, known).all()
