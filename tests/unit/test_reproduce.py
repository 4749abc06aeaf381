"""The paper's table from nothing: what is planned, that it resumes, and that the page says what was measured."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_simulator import KnownSimulator

from lcd_flight.learning import reproduce as reproduce_module
from lcd_flight.learning.experiments import experiments
from lcd_flight.learning.methods import METHODS, baseline_model
from lcd_flight.learning.reproduce import reproduce
from lcd_flight.learning.reproduction_models import BASELINES, LESSONS, model_name, trainings
from lcd_flight.learning.reproduction_settings import DRAGS, WORLDS, ReproduceSettings
from lcd_flight.learning.results_page import page, write_results
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import InputError
from lcd_flight.worlds import load_world

SETTINGS = ReproduceSettings(seed=5)
ROOT = Path(__file__).parents[2]


def test_each_table_and_each_model_has_a_name_of_its_own():
    tables = [e.name for e in experiments(SETTINGS)]
    models = [config.name for config in trainings(replace(SETTINGS, per_drag=True))]
    assert len(set(tables)) == len(tables)
    assert len(set(models)) == len(models)


def test_the_paper_experiment_is_all_worlds_drags_and_methods():
    paper = [e for e in experiments(SETTINGS) if e.group == "paper"]
    assert {(e.world.name, e.options.timing) for e in paper} == {(w, t) for w in WORLDS for t in ("fixed", "retimed")}
    for experiment in paper:
        assert experiment.options.drags == DRAGS
        assert experiment.methods == tuple(METHODS)
        assert experiment.trained


def test_every_model_that_is_flown_is_trained():
    for settings in (SETTINGS, replace(SETTINGS, per_drag=True)):
        made = {config.name: config for config in trainings(settings)}
        for experiment in experiments(settings):
            if not experiment.trained:
                continue
            for drag in experiment.options.drags:
                drags = (drag,) if settings.per_drag and not experiment.recipe else DRAGS
                name = model_name(settings, experiment.world, drags, experiment.recipe)
                assert made[name].drags == drags
                for method, recipe in BASELINES.items():
                    assert method not in experiment.methods or baseline_model(name, recipe) in made


def test_one_model_serves_the_worlds_of_a_vehicle():
    configs = trainings(SETTINGS)
    main = [config for config in configs if config.name.endswith("-medium")]
    assert sorted(tuple(w.name for w in c.worlds) for c in main) == [tuple(WORLDS[:2]), (WORLDS[2],)]
    assert {c.name.removeprefix("crazyflie-paper-medium-") for c in configs} >= {*LESSONS, *BASELINES.values()}


def test_weaker_longer_and_shorter_are_what_they_say():
    beyond = {e.name: e for e in experiments(SETTINGS) if e.group == "beyond"}
    assert beyond["crazyflie-saturated-fixed-10-waypoints"].world.sampler.waypoints == 10
    assert beyond["hummingbird-paper-retimed-thrust_share"].options.thrust_share == 0.95
    assert beyond["hummingbird-paper-retimed-yaw"].options.yaw == "short"
    assert not beyond["crazyflie-flight-fixed"].trained
    assert beyond["crazyflie-flight-fixed"].world.loop == "flight"


def test_with_shipped_models_nothing_is_trained():
    settings = replace(SETTINGS, models="shipped")
    assert trainings(settings) == []
    found = experiments(settings)
    assert not any(e.trained or e.group in ("lesson", "shipped") for e in found)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"recipe": "paper-code"}, "choose one of small, medium, full"),
        ({"count": 1}, "at least 2 tasks"),
        ({"noise_seeds": 0}, "at least 2 tasks and 1 seed"),
        ({"models": "shipped", "per_drag": True}, "leave out --per-drag"),
    ],
)
def test_settings_that_make_no_sense_are_refused_at_once(change, message):
    with pytest.raises(InputError, match=message):
        replace(SETTINGS, **change)


def test_the_command_is_the_one_that_makes_it_again():
    assert SETTINGS.command == "lcd reproduce --recipe medium"
    settings = replace(SETTINGS, models="shipped", count=300, noise_seeds=2)
    assert settings.command == "lcd reproduce --count 300 --noise-seeds 2 --models shipped"
    assert replace(SETTINGS, per_drag=True).command == "lcd reproduce --recipe medium --per-drag"


@pytest.fixture(scope="module")
def light():
    """Every method is minimum snap, every training a file: the course of a reproduction without its work."""
    trained = []

    def train(config, folder, out, simulator, progress):
        trained.append(config.name)
        out.parent.mkdir(parents=True, exist_ok=True)
        out.touch()

    with pytest.MonkeyPatch.context() as patch:
        minimum = METHODS["minimum-snap"]
        for name in METHODS:
            patch.setitem(METHODS, name, minimum)
        patch.setattr(reproduce_module, "train", train)
        yield trained


QUICK = ReproduceSettings(seed=5, count=6, noise_seeds=2, quick=True)


@pytest.fixture(scope="module")
def course(light, tmp_path_factory):
    """One whole course: the result, its work folder, its calls of the simulator, what it told."""
    work, simulator, told = tmp_path_factory.mktemp("course"), KnownSimulator(), []
    result = reproduce(QUICK, work, simulator, told.append)
    return result, work, simulator.calls, told


def test_a_course_from_nothing_to_the_page(light, course, tmp_path):
    result, work, _, told = course
    models = [config.name for config in trainings(QUICK)]
    assert light[: len(models)] == models
    assert told[-1].stage == told[-1].stages == len(models) + len(result.experiments)
    path = write_results(result, tmp_path, KnownSimulator())
    text = path.read_text()
    assert "{{" not in text
    assert "tries out every step" in text
    shown = set(re.findall(r"\]\(([\w.-]+\.(?:svg|json))\)", text))
    assert shown == {p.name for p in path.parent.iterdir()} - {"README.md"}
    assert str(work) not in text + (path.parent / "results.json").read_text()
    for method in METHODS:
        assert f"| `{method}` |" in text


def test_the_page_says_the_rates_that_were_measured(course, tmp_path):
    text = write_results(course[0], tmp_path, KnownSimulator()).read_text()
    numbers = json.loads((tmp_path / "results.json").read_text())
    figures = numbers["experiments"]["crazyflie-paper-fixed"]["methods"]["minimum-snap"]
    crashed = np.abs(first_tasks(load_world("crazyflie-paper").sampler, 5, 6).waypoints_m[:, 0, 0]) > 1.5
    assert figures["crash_rate"] == pytest.approx(100.0 * crashed.mean(), rel=1e-4)
    assert f"gives {figures['crash_rate']:.1f} ({figures['crash_rate_error']:.1f}) % for minimum snap" in text


def test_run_again_it_flies_nothing_and_says_the_same(course):
    result, work, _, _ = course
    simulator = KnownSimulator()
    again = reproduce(QUICK, work, simulator, lambda progress: None)
    assert not simulator.calls
    assert page(replace(again, seconds=result.seconds), []) == page(result, [])


def test_interrupted_it_goes_on(course, tmp_path):
    result, _, calls, _ = course
    with pytest.raises(KeyboardInterrupt):
        reproduce(QUICK, tmp_path, KnownSimulator(interrupted_in=31), lambda progress: None)
    rest = KnownSimulator()
    resumed = reproduce(QUICK, tmp_path, rest, lambda progress: None)
    assert len(rest.calls) == len(calls) - 30
    for name, evaluation in result.evaluations.items():
        for method, run in evaluation.runs.items():
            assert np.array_equal(resumed.evaluations[name].runs[method].max_error_m, run.max_error_m)


def test_a_model_for_each_drag_flies_in_its_own(light, tmp_path, monkeypatch):
    """With --per-drag every configuration is flown with the model trained over it."""
    seen = set()
    minimum = METHODS["minimum-snap"]

    def learned(problem):
        seen.add((problem.world.name, problem.vehicle.parasitic_drag, Path(problem.model).stem))
        return minimum(problem)

    monkeypatch.setitem(METHODS, "learned", learned)
    settings = ReproduceSettings(seed=5, count=2, noise_seeds=1, per_drag=True, quick=False)
    reproduce(settings, tmp_path, KnownSimulator(), lambda progress: None)
    world = load_world("hummingbird-paper")
    for drag in DRAGS:
        c_D = world.vehicle(drag).parasitic_drag
        assert ("hummingbird-paper", c_D, f"hummingbird-paper-drag-{drag}-medium") in seen


def test_paragraphs_on_methods_that_were_not_flown_are_left_out(course):
    result = course[0]
    assert "The objective as released" in page(result, [])
    assert "reinforcement-learning baseline** (100 %" in page(result, [])
    fewer = [replace(e, methods=tuple(m for m in e.methods if m != "paper")) for e in result.experiments]
    assert "The objective as released" not in page(replace(result, experiments=fewer), [])


def test_what_the_page_points_to_is_there(course):
    targets = re.findall(r"\]\((\.\./[^)#\s]+)\)", page(course[0], []))
    assert targets
    assert [t for t in targets if not (ROOT / "docs" / "results" / t).resolve().exists()] == []


def test_what_cannot_be_flown_is_told_before_anything_is_trained(light, tmp_path, monkeypatch):
    def refuse(problem):
        raise InputError("controller of tomorrow")

    monkeypatch.setitem(METHODS, "search", refuse)
    before = len(light)
    with pytest.raises(InputError, match="controller of tomorrow"):
        reproduce(QUICK, tmp_path, KnownSimulator(), lambda progress: None)
    assert len(light) == before


def test_beyond_the_paper_who_cannot_fly_is_left_out(light, tmp_path, monkeypatch):
    minimum = METHODS["minimum-snap"]

    def short_only(problem):
        if problem.tasks.waypoints_m.shape[1] > 4:
            raise InputError("four waypoints at most")
        return minimum(problem)

    monkeypatch.setitem(METHODS, "search", short_only)
    settings = replace(QUICK, count=2)
    result = reproduce(settings, tmp_path, KnownSimulator(), lambda progress: None)
    assert "search" not in result.evaluations["crazyflie-saturated-fixed-10-waypoints"].runs
    assert "search" in result.evaluations["crazyflie-paper-retimed-yaw"].runs
    assert "Empty: the method cannot plan or fly there" in page(result, [])


def test_prose_stands_in_even_lines(course):
    text = page(course[0], [])
    prose = [line for line in text.splitlines() if not line.startswith(("|", "!", "#"))]
    assert max(map(len, prose)) <= 120
    assert not any("  " in line.strip() for line in prose)
