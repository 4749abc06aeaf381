"""`lcd collect` as a user gives it: what it says, what it refuses, each in one clear line."""

import json
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from docs_pages import blocks

from lcd_flight.cli.main import app, run
from lcd_flight.learning.dataset import open_dataset

LCD = [sys.executable, "-c", "from lcd_flight.cli.main import lcd; lcd()"]
SHIPPED = Path(__file__).parents[2] / "lcd_flight" / "worlds" / "data" / "vehicles" / "crazyflie.yaml"


@pytest.fixture
def collect(tmp_path, monkeypatch, capsys):
    """Runs the command in a folder of its own; gives the exit code and the JSON object."""
    monkeypatch.chdir(tmp_path)

    def command(*options, world="crazyflie-saturated", out="data", count=30):
        arguments = ["collect", "--world", world, "--out", out, "--count", str(count), "--json", *options]
        code = run(app, arguments)
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return code, json.loads(captured.out.splitlines()[-1]), captured.err

    return command


def test_a_data_set(collect):
    code, result, told = collect("--seed", "3")
    assert code == 0
    assert result["outcome"] == "ok"
    assert result["rollouts"] == 30
    assert sum(result["sources"].values()) == 30
    assert result["data_hash"] == open_dataset(Path("data")).hash
    assert "30 rollouts at data" in told
    assert collect("--seed", "3", count=40)[1]["rollouts"] == 40


def test_every_option_is_part_of_the_configuration(collect):
    collect("--sources", "times=0.5,optimum=0.5", "--loop", "flight", "--waypoints", "5", "--short-yaw", "1")
    found = open_dataset(Path("data")).configuration
    assert (found["mix"]["times"], found["mix"]["search"]) == (0.5, 0.0)
    assert found["world"]["loop"] == "flight"
    assert found["world"]["sampler"]["waypoints"] == 5
    assert found["short_yaw_share"] == 1.0
    code, result, _ = collect(
        "--sources", "times=0.5,optimum=0.5", "--loop", "paper", "--waypoints", "5", "--short-yaw", "1"
    )
    assert code == 2
    assert "world.loop: paper, there flight" in result["error"]


def test_threads_are_not(collect):
    collect("--threads", "1", out="one")
    collect("--threads", "2", out="two")
    files = [sorted(Path(name).iterdir()) for name in ("one", "two")]
    assert [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[1]]


def test_another_vehicle_keeps_the_worlds_disturbances(collect):
    Path("mine.yaml").write_text(SHIPPED.read_text().replace("mass_kg: 0.03", "mass_kg: 0.031"))
    assert collect("--vehicle", "mine.yaml")[0] == 0
    vehicle = open_dataset(Path("data")).configuration["world"]["base_vehicle"]
    assert vehicle["mass_kg"] == 0.031
    assert (vehicle["motor_time_constant_s"], vehicle["motor_noise"]) == (0.005, 100.0)


def test_proposals_as_the_page_makes_them(collect):
    (block,) = blocks("data.md", "python")
    exec(compile(block.text, "docs/data.md", "exec"), {"__name__": "docs"})  # noqa: S102 - our own page
    code, result, _ = collect("--plans", "proposals.npz", world="crazyflie-paper", count=32)
    assert code == 0
    assert result["sources"] == {"given": 32}
    mixed = collect(
        "--plans", "proposals.npz", "--sources", "plans=0.5,random=0.5", world="crazyflie-paper", out="mixed"
    )
    assert set(mixed[1]["sources"]) == {"given", "random"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"world": "crazyflie-saturatde"}, "world 'crazyflie-saturatde' is not known; worlds: crazyflie-flight"),
        ({"world": "crazyflie-paper@fast"}, "'fast' is no speed"),
        ({"options": ("--vehicle", "mine.yaml")}, "mine.yaml"),
        ({"options": ("--vehicle", "none.yaml")}, "vehicle 'none.yaml' is neither a vehicle file"),
        ({"options": ("--loop", "inner")}, "--loop inner: choose paper or flight"),
        ({"options": ("--sources", "search=0.5")}, "add up to 1"),
        ({"options": ("--sources", "plans=1")}, "a file of plans go together"),
        ({"options": ("--plans", "none.npz")}, "none.npz: no such file"),
        ({"options": ("--short-yaw", "2")}, "--short-yaw"),
        ({"options": ("--waypoints", "2")}, "--waypoints"),
        ({"count": 0}, "--count"),
        ({"out": "mine.yaml"}, "mine.yaml: cannot be written to"),
        ({"out": "/proc/data"}, "/proc/data: cannot be written to"),
    ],
)
def test_bad_input_is_one_clear_line_and_leaves_nothing(collect, options, said):
    Path("mine.yaml").write_text(SHIPPED.read_text().replace("mass_kg: 0.03", "mass_kg: -0.03"))
    code, result, told = collect(*options.pop("options", ()), **options)
    assert code == 2
    assert result["outcome"] == "invalid_input"
    assert said in result["error"]
    assert len(told.strip().splitlines()) == 1
    assert not Path("data").exists()


def test_a_negative_mass_is_told_with_its_line(collect):
    Path("mine.yaml").write_text(SHIPPED.read_text().replace("mass_kg: 0.03", "mass_kg: -0.03"))
    _, result, _ = collect("--vehicle", "mine.yaml")
    assert "mass_kg" in result["error"]
    assert "-0.03" in result["error"]


def test_a_shard_cut_in_half_is_named_and_made_again_once_deleted(collect):
    options = ("--sources", "optimum=1", "--shard-rows", "20")
    collect(*options, count=50)
    whole = {path.name: path.read_bytes() for path in Path("data").iterdir()}
    half = Path("data/shard-00001.parquet")
    half.write_bytes(half.read_bytes()[: half.stat().st_size // 2])
    code, result, told = collect(*options, count=50)
    assert code == 2
    assert result["error"].startswith("data/shard-00001.parquet: damaged (")
    assert "delete it and run the same `lcd collect` again" in result["error"]
    assert len(told.strip().splitlines()) == 1
    assert Path("data/shard-00000.parquet").read_bytes() == whole["shard-00000.parquet"]
    half.unlink()
    assert collect(*options, count=50)[0] == 0
    assert {path.name: path.read_bytes() for path in Path("data").iterdir()} == whole


def test_without_ray_its_extra_is_named(collect, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    code, result, _ = collect("--ray", "auto")
    assert code == 2
    assert "pip install 'lcd-flight[ray]'" in result["error"]


def test_a_full_disk_leaves_the_earlier_shards(tmp_path):
    """No file of this process may grow beyond 0.5 MB, so that a small shard fits and a whole one does not."""

    def little_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000))

    command = [
        *LCD,
        "collect",
        "--world",
        "crazyflie-saturated",
        "--sources",
        "optimum=1",
        "--out",
        str(tmp_path),
        "--json",
    ]
    subprocess.run([*command, "--count", "1000"], check=True, capture_output=True)
    before = (tmp_path / "shard-00000.parquet").read_bytes()
    done = subprocess.run(
        [*command, "--count", "4000"], check=False, capture_output=True, text=True, preexec_fn=little_room
    )
    assert done.returncode == 2
    assert done.stderr.count("error: ") == 1
    assert "shard-00000.parquet: cannot be written (File too large); choose another place, or make room" in done.stderr
    assert (tmp_path / "shard-00000.parquet").read_bytes() == before
    assert not list(tmp_path.glob(".*"))
