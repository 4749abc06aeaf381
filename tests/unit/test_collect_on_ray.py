"""`lcd collect --ray` on a real cluster of two nodes, one of which dies in the middle: nothing lost, the same bytes."""

import subprocess
import sys
import textwrap

import pytest

from lcd_flight.learning.collect import CollectConfig, collect
from lcd_flight.learning.mix import parse_mix
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_world

SHARDS, ROWS = 12, 2_000
SOURCES = "random=0.5,optimum=0.5"

SCENE = """
    import subprocess, sys, time
    from pathlib import Path
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    mortal = cluster.add_node(num_cpus=1)
    folder, command = Path(sys.argv[1]), sys.argv[2:]
    process = subprocess.Popen([*command, "--ray", cluster.address])
    while not list(folder.glob("shard-*.parquet")):
        assert process.poll() is None, "it ended before the first shard"
        time.sleep(0.01)
    cluster.remove_node(mortal, allow_graceful=False)
    assert process.poll() is None, "it ended before the node died"
    code = process.wait()
    cluster.shutdown()
    sys.exit(code)
"""
"""In a process of its own, since Ray leaves threads and handlers behind."""


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_a_node_dies(tmp_path):
    pytest.importorskip("ray")
    lcd = [sys.executable, "-c", "from lcd_flight.cli.main import lcd; lcd()"]
    command = [*lcd, "collect", "--world", "crazyflie-saturated", "--sources", SOURCES, "--shard-rows", str(ROWS)]
    command += ["--count", str(SHARDS * ROWS), "--out", str(tmp_path / "cluster")]
    scene = [sys.executable, "-c", textwrap.dedent(SCENE), str(tmp_path / "cluster"), *command]
    done = subprocess.run(scene, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"{SHARDS * ROWS:,} rollouts" in done.stdout
    config = CollectConfig(load_world("crazyflie-saturated"), seed=0, mix=parse_mix(SOURCES, ROWS))
    collect(config, SHARDS * ROWS, tmp_path / "here", simulator())
    assert contents(tmp_path / "cluster") == contents(tmp_path / "here")


def test_an_address_without_a_cluster_is_one_clear_line(tmp_path):
    pytest.importorskip("ray")
    lcd = [sys.executable, "-c", "from lcd_flight.cli.main import lcd; lcd()"]
    command = [
        *lcd,
        "collect",
        "--world",
        "crazyflie-saturated",
        "--count",
        "5",
        "--out",
        str(tmp_path),
        "--ray",
        "auto",
    ]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 2, done.stderr
    assert "error: --ray auto: no cluster there (ConnectionError: " in done.stderr
    assert "start one with `ray start --head`" in done.stderr
    assert "Traceback" not in done.stderr
