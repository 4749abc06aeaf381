"""An evaluation as files for others: JSON, every flight as Parquet, and figures."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lcd_flight.files import write_whole
from lcd_flight.learning.evaluation import Evaluation
from lcd_flight.learning.evaluation_figures import crash_rate_figure, error_figure
from lcd_flight.learning.evaluation_files import write_flights
from lcd_flight.learning.fingerprint import versions

Pairs = Sequence[tuple[str, str]]
"""Names of methods to compare: the first minus the second."""


def report(evaluations: Sequence[Evaluation], pairs: Pairs = ()) -> dict[str, Any]:
    """What `--json` prints: of one world its own object, of several one below `worlds` for each."""
    if len(evaluations) == 1:
        return _of_one(evaluations[0], pairs)
    return {"worlds": {evaluation.world: _of_one(evaluation, pairs) for evaluation in evaluations}}


def write_report(folder: Path, evaluations: Sequence[Evaluation], pairs: Pairs = ()) -> None:
    """Write `evaluation.json`, `flights.parquet` and, for each world, `crash-rates-*.svg` and `errors-*.svg`.

    Raises:
        InputError: pyarrow is not installed, or a file cannot be written.
    """
    result = report(evaluations, pairs) | {"versions": versions("numpy", "numba")}
    write_whole(folder / "evaluation.json", json.dumps(_finite(result), indent=1, allow_nan=False) + "\n")
    write_flights(folder / "flights.parquet", list(evaluations))
    for evaluation in evaluations:
        options = evaluation.options
        title = f"{evaluation.world}, {options.timing}, drag {', '.join(map(str, options.drags))}"
        write_whole(folder / f"crash-rates-{evaluation.world}.svg", crash_rate_figure(title, evaluation))
        write_whole(folder / f"errors-{evaluation.world}.svg", error_figure(title, evaluation))


def _of_one(evaluation: Evaluation, pairs: Pairs) -> dict[str, Any]:
    comparisons = [{"a": a, "b": b, **asdict(evaluation.compare(a, b))} for a, b in pairs]
    return {**evaluation.as_json(), "comparisons": comparisons}


def _finite(value: Any) -> Any:
    """The same with null for numbers that JSON has no word for."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
