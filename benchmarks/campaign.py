"""Long comparisons: `make campaign`. Each leaves a dated result in docs/campaigns."""

from __future__ import annotations

import datetime
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.campaign_crazyflie_fuzz import crazyflie_fuzz
from benchmarks.campaign_mavlink_fuzz import mavlink_fuzz
from benchmarks.campaign_rotorpy import rotorpy_crash_rates
from benchmarks.campaign_sigkill import killed_flights
from lcd_flight import api
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.mission.task_mission import task_mission
from lcd_flight.model import FloatArray, RefusedError
from lcd_flight.rehearsal.verdict import Rehearsal
from lcd_flight.worlds import load_world

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs" / "campaigns"
PLANNERS = ("minimum-snap", "learned", "learned-polished")


def main() -> None:
    """Run all campaigns, or those that are named."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[1:] or CAMPAIGNS:
        result = {"date": datetime.date.today().isoformat(), "campaign": name, **CAMPAIGNS[name]()}
        path = RESULTS / f"{result['date']}-{name}.json"
        path.write_text(json.dumps(result, indent=1) + "\n")
        print(f"{path.relative_to(ROOT)}: {json.dumps(result.get('summary', result))}")  # noqa: T201


def rehearsed_tasks(count: int = 200, seed: int = 1) -> dict[str, Any]:
    """Sampled tasks of `crazyflie-flight` as missions: which planners' plans are refused in rehearsal?

    A plan passes where each of 100 rehearsed flights is completed and 95 % of them keep within 0.75 m.
    """
    world = load_world("crazyflie-flight")
    tasks = first_tasks(world.sampler, seed, count)
    rows = []
    for index, waypoints in enumerate(tasks.poses):
        verdicts = {planner: _rehearsed(waypoints, world.speed, planner) for planner in PLANNERS}
        rows.append({"index": index, **verdicts})
        if (index + 1) % 20 == 0:
            print(f"{index + 1}/{count} tasks")  # noqa: T201
    summary = Counter(", ".join(f"{planner} {_word(row[planner])}" for planner in PLANNERS) for row in rows)
    return {"world": f"{world.name} v{world.version}", "seed": seed, "tasks": count, "summary": summary, "rows": rows}


def _rehearsed(waypoints: FloatArray, speed: float, planner: str) -> dict[str, Any]:
    """Plan and rehearse one task with one planner."""
    text = task_mission("", "task", waypoints, speed, vehicle="crazyflie", planner=planner)
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(text)
        file.flush()
        try:
            flight = api.plan(file.name, cache=False)
        except RefusedError as error:
            return {"passed": False, "refused_path": str(error)}
    return _facts(api.rehearse(flight))


def _facts(rehearsal: Rehearsal) -> dict[str, Any]:
    return {
        "passed": rehearsal.passed,
        "completed": int(rehearsal.completed.sum()),
        "p95_error_m": round(rehearsal.p95_error_m, 3),
        "max_error_m": round(rehearsal.max_error_m, 3),
        "longest_saturation_s": round(rehearsal.longest_saturation_s, 2),
    }


def _word(verdict: dict[str, Any]) -> str:
    return "passes" if verdict["passed"] else "refused"


CAMPAIGNS: dict[str, Callable[[], dict[str, Any]]] = {
    "rehearsed-tasks": rehearsed_tasks,
    "crazyflie-fuzz": crazyflie_fuzz,
    "mavlink-fuzz": mavlink_fuzz,
    "killed-flights": killed_flights,
    "rotorpy-crash-rates": rotorpy_crash_rates,
}


if __name__ == "__main__":
    main()
