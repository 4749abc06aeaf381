"""The code in the documentation does what the pages say."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import socket
import threading
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from docs_pages import ROOT, Block, blocks

from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import AttitudeThrust, InputError, LinkContext, RefusedError, RolloutOptions, Trajectories
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.wire.mocap_frame import decode
from lcd_flight.worlds import load_vehicle

LAB = ROOT / "examples" / "lab_back_ends"
CLOCK = RealClock()
MS = 1_000_000


def runnable(name: str) -> list[Block]:
    return [block for block in blocks(name, "python") if block.runs and "sys.argv" not in block.text]


def run(block: Block) -> dict[str, Any]:
    namespace: dict[str, Any] = {"__name__": "docs"}
    exec(compile(block.text, f"docs/{block.page}:{block.line}", "exec"), namespace)  # noqa: S102 - our own pages
    return namespace


@pytest.mark.parametrize("name", ["api.md"])
def test_python_blocks_are_python(name: str) -> None:
    assert blocks(name, "python")
    for block in blocks(name, "python"):
        compile(block.text, f"docs/{name}:{block.line}", "exec")


@pytest.mark.parametrize("block", [*runnable("method.md"), *runnable("api.md")], ids=lambda b: f"{b.page}:{b.line}")
def test_python_blocks_run(block: Block, capsys: pytest.CaptureFixture[str]) -> None:
    run(block)
    assert "Error" not in capsys.readouterr().err


def test_the_api_page_shows_the_example() -> None:
    example = (ROOT / "examples" / "fly_a_mission.py").read_text(encoding="utf-8")
    assert blocks("api.md", "python")[0].text in example


def test_the_api_page_shows_the_declarations_and_the_simulator_of_the_example_package() -> None:
    declared = tomllib.loads((LAB / "pyproject.toml").read_text())["project"]["entry-points"]
    assert tomllib.loads(blocks("api.md", "toml")[0].text)["project"]["entry-points"] == declared
    body = [line.strip() for line in blocks("api.md", "python")[-1].text.splitlines()[-2:]]
    assert all(line in (LAB / "tired.py").read_text() for line in body)


def test_frames_of_the_api_page_are_frames() -> None:
    (block,) = (b for b in runnable("api.md") if "def frame" in b.text)
    data = run(block)["frame"](4, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
    frame = decode(data)
    assert (frame.sequence, frame.position, frame.body) == (4, (1.0, 2.0, 3.0), "cf1")


def test_the_vehicle_file_of_the_simulator_page_flies(tmp_path: Path) -> None:
    """A gentle way, in the loop that missions fly."""
    (block,) = blocks("simulator.md", "yaml")
    path = tmp_path / "deck.yaml"
    path.write_text(block.text, encoding="utf-8")
    vehicle = load_vehicle(path)
    assert vehicle.thrust_to_weight > 1.3
    way = minimum_snap(np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.5, 1.2, 0.5]]), np.array([2.5]))
    copies, seeds = Trajectories.stack([way] * 8), np.arange(8, dtype=np.uint64)
    labels = plugins.simulator().rollout(copies, vehicle, seeds, RolloutOptions(loop="flight"))
    assert labels.max_error_m.max() < 0.3
    assert len(set(labels.max_error_m)) > 1, "noise makes flights differ"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The example package, as if installed: its metadata where `importlib.metadata` looks."""
    project = tomllib.loads((LAB / "pyproject.toml").read_text())["project"]
    info = tmp_path / "lab_back_ends-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    lines = [
        line
        for group, points in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{name} = {target}" for name, target in points.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    monkeypatch.syspath_prepend(str(LAB))
    monkeypatch.syspath_prepend(str(tmp_path))


class Vehicle(threading.Thread):
    """What json:// talks to: notes what it hears, and answers with telemetry once it is spoken to."""

    def __init__(self, *, arms: bool) -> None:
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(10.0)
        self.port: int = self.socket.getsockname()[1]
        self.heard: list[dict[str, Any]] = []
        self._arms, self._armed = arms, False

    def run(self) -> None:
        while not (self.heard and "stop" in self.heard[-1]):
            data, peer = self.socket.recvfrom(2048)
            self.heard.append(json.loads(data))
            self._armed = self._arms and self.heard[-1].get("arm", self._armed)
            self.socket.sendto(b"not telemetry", peer)
            self.socket.sendto(json.dumps({"battery_V": 4.1, "armed": self._armed}).encode(), peer)


@contextlib.contextmanager
def a_vehicle(*, arms: bool = True) -> Iterator[Vehicle]:
    vehicle = Vehicle(arms=arms)
    vehicle.start()
    try:
        yield vehicle
    finally:
        vehicle.join(20.0)
        vehicle.socket.close()


def context() -> LinkContext:
    return LinkContext(load_vehicle("crazyflie"), CLOCK, (0.0, 0.0, 0.0), 0.0, 0)


@pytest.mark.usefixtures("installed")
def test_the_example_link() -> None:
    async def fly(port: int) -> None:
        async with plugins.open_link(f"json://127.0.0.1:{port}", context()) as link:
            await link.arm()
            now_ns = CLOCK.now_ns()
            link.send(AttitudeThrust(0.3, (0.0, 0.0, 0.0, 1.0)), now_ns)
            for setpoint, stamp_ns in (
                (AttitudeThrust(0.4, (0.0, 0.0, 0.0, 1.0)), now_ns - 60 * MS),
                (AttitudeThrust(math.nan, (0.0, 0.0, 0.0, 1.0)), now_ns),
            ):
                link.send(setpoint, stamp_ns)
            report = link.report(CLOCK.now_ns())
            assert report.telemetry is not None
            assert (report.telemetry.battery_V, report.telemetry.armed) == (4.1, True)
            assert (report.sent, report.stale, report.connected) == (1, 2, True)
            link.stop_motors()
            link.send(AttitudeThrust(0.5, (0.0, 0.0, 0.0, 1.0)), CLOCK.now_ns())

    with a_vehicle() as vehicle:
        asyncio.run(fly(vehicle.port))
    assert [said["thrust_N"] for said in vehicle.heard if "thrust_N" in said] == [0.3]
    assert "hello" in vehicle.heard[0]
    assert "stop" in vehicle.heard[-1]


@pytest.mark.usefixtures("installed")
def test_the_example_link_says_why_it_does_not_arm() -> None:
    async def fly(port: int) -> None:
        async with plugins.open_link(f"json://127.0.0.1:{port}", context()) as link:
            await link.arm()

    with a_vehicle(arms=False) as vehicle, pytest.raises(RefusedError, match="did not arm"):
        asyncio.run(fly(vehicle.port))
    assert "stop" in vehicle.heard[-1]
    with pytest.raises(InputError, match="json://HOST:PORT"):
        plugins.open_link("json://nowhere", context())


@pytest.mark.usefixtures("installed")
def test_the_example_pose_source() -> None:
    (block,) = (b for b in runnable("api.md") if "def frame" in b.text)
    frame = run(block)["frame"]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]

    async def listen() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            async with plugins.pose_source(f"udp://127.0.0.1:{port}", "cf1", CLOCK) as source:
                with pytest.raises(RefusedError, match="choose another port"):
                    await plugins.pose_source(f"udp://127.0.0.1:{port}", "cf1", CLOCK).__aenter__()
                for n in range(10):
                    sender.sendto(frame(n, (1.0, 0.0, 1e-4 * n), (0.0, 0.0, 0.0, 1.0)), ("127.0.0.1", port))
                    await asyncio.sleep(0.005)
                report = source.report(CLOCK.now_ns())
                assert report.received == 10
                assert report.raw is not None
                assert report.raw.p_WB == (1.0, 0.0, pytest.approx(9e-4))

    asyncio.run(listen())
    with pytest.raises(InputError, match="udp://HOST:PORT"):
        plugins.pose_source("udp://nowhere", "cf1", CLOCK)


@pytest.mark.usefixtures("installed")
def test_the_example_simulator_flies_lower() -> None:
    copies = Trajectories.stack(
        [minimum_snap(np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0]]), np.array([2.0]))] * 4
    )
    seeds, vehicle = np.arange(4, dtype=np.uint64), load_vehicle("crazyflie")
    shipped, tired = (
        plugins.simulator(n).rollout(copies, vehicle, seeds, RolloutOptions()) for n in ("multirotor", "tired")
    )
    assert (tired.rms_error_m > shipped.rms_error_m).all()
