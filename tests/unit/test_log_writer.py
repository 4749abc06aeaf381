"""What stands in a flight log, for our reader and for everybody else's."""

from __future__ import annotations

import contextlib
import io
import os
from collections import defaultdict
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import pytest
import synthetic_flight
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader
from mcap.records import Message
from synthetic_flight import Pair

from lcd_flight.model import Finding, InputError, MotorRequest, Phase, PoseReport, RefusedError, Severity
from lcd_flight.record import FlightHeader, LogWriter, read_log, read_ticks
from lcd_flight.record.topics import TOPICS

FINDING = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)", 0.042, 0.3)


def written(path: Path, pairs: list[Pair], header: FlightHeader | None = None) -> Path:
    """A closed log of these ticks."""
    writer = LogWriter(path, header or synthetic_flight.header())
    for inputs, tick in pairs:
        writer.write(inputs, tick)
    writer.close()
    return path


def messages(path: Path) -> dict[str, list[Message]]:
    """All messages by topic, as mcap's own reader has them."""
    found: dict[str, list[Message]] = defaultdict(list)
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            found[channel.topic].append(message)
    return found


@pytest.fixture(scope="module")
def pairs() -> list[Pair]:
    return synthetic_flight.with_finding(synthetic_flight.flight(), 300, 305, FINDING)


@pytest.fixture(scope="module")
def log(pairs: list[Pair], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("log") / "flight.mcap", pairs)


def test_ticks_come_back_equal(log: Path, pairs: list[Pair]) -> None:
    assert read_ticks(log) == pairs
    assert read_log(log).complete


def test_every_topic_of_the_table_is_registered_with_its_schema(log: Path) -> None:
    with log.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    registered = {
        channel.topic: (summary.schemas[channel.schema_id].name, channel.message_encoding, channel.metadata["units"])
        for channel in summary.channels.values()
    }
    assert registered == {topic.name: (topic.schema_name, topic.encoding, topic.units) for topic in TOPICS}


def test_times_are_the_hosts_and_the_sources(log: Path, pairs: list[Pair]) -> None:
    for (inputs, tick), message in zip(pairs, messages(log)["/pose"], strict=True):
        assert inputs.pose.raw is not None
        assert message.log_time == tick.now_ns
        assert message.publish_time == inputs.pose.raw.source_stamp_ns
        assert message.sequence == tick.sequence


@pytest.mark.parametrize(("stamp_ns", "published"), [(-5, 0), (2**70, 2**64 - 1)])
def test_a_source_may_have_any_clock(tmp_path: Path, pairs: list[Pair], stamp_ns: int, published: int) -> None:
    inputs, tick = pairs[0]
    assert inputs.pose.raw is not None
    raw = replace(inputs.pose.raw, source_stamp_ns=stamp_ns)
    path = tmp_path / "clock.mcap"
    writer = LogWriter(path, synthetic_flight.header())
    writer.write(replace(inputs, pose=replace(inputs.pose, raw=raw)), tick)
    writer.close()
    assert messages(path)["/pose"][0].publish_time == published


def test_viewers_get_the_pose_the_reference_and_the_transform(log: Path, pairs: list[Pair]) -> None:
    found = messages(log)
    inputs, tick = pairs[400]
    assert inputs.pose.state is not None
    assert tick.reference is not None
    pose = PoseInFrame.FromString(found["/pose"][400].data)
    assert pose.frame_id == "world"
    assert (pose.pose.position.x, pose.pose.position.y, pose.pose.position.z) == inputs.pose.state.p_WB
    assert pose.timestamp.ToNanoseconds() == tick.now_ns
    (transform,) = FrameTransforms.FromString(found["/tf"][400].data).transforms
    assert (transform.parent_frame_id, transform.child_frame_id) == ("world", "vehicle")
    q = transform.rotation
    assert (q.x, q.y, q.z, q.w) == inputs.pose.state.q_WB
    first_with_reference = next(i for i, (_, t) in enumerate(pairs) if t.reference is not None)
    reference = PoseInFrame.FromString(found["/reference"][400 - first_with_reference].data)
    assert (reference.pose.position.x, reference.pose.position.z) == (tick.reference.p_W[0], tick.reference.p_W[2])


def test_viewers_get_the_scene_once_at_the_first_tick(log: Path, pairs: list[Pair]) -> None:
    found = messages(log)
    (plan,), (scene,) = found["/plan"], found["/scene"]
    assert plan.log_time == scene.log_time == pairs[0][1].now_ns
    poses = PosesInFrame.FromString(plan.data).poses
    end = synthetic_flight.WAYPOINTS[-1]
    assert (poses[0].position.z, poses[-1].position.z) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert (poses[-1].position.x, poses[-1].position.y) == pytest.approx((end[0], end[1]))
    entities = {entity.id: entity for entity in SceneUpdate.FromString(scene.data).entities}
    assert set(entities) == {"geofence", "planned path", "minimum snap", "vehicle"} | {
        f"waypoint {n}" for n in range(1, 5)
    }
    assert len(entities["geofence"].lines[0].points) == 24
    assert entities["vehicle"].frame_id == "vehicle"
    assert len(entities["vehicle"].cylinders) == 4
    assert entities["waypoint 3"].spheres[0].pose.position.z == 1.8


def test_the_edges_of_the_fence_are_edges(log: Path) -> None:
    scene = SceneUpdate.FromString(messages(log)["/scene"][0].data)
    fence = next(entity for entity in scene.entities if entity.id == "geofence").lines[0]
    corners = [(p.x, p.y, p.z) for p in fence.points]
    edges = {frozenset(edge) for edge in zip(corners[::2], corners[1::2], strict=True)}
    assert len(edges) == 12
    for a, b in edges:
        assert sum(x != y for x, y in zip(a, b, strict=True)) == 1


def test_the_log_panel_tells_phases_findings_and_what_the_vehicle_says(log: Path) -> None:
    lines = [Log.FromString(message.data) for message in messages(log)["/log"]]
    assert [line.message for line in lines if line.name == "phase"] == [
        "preflight",
        "armed",
        "takeoff",
        "hold",
        "track",
        "land",
        "landed",
    ]
    assert [(line.level, line.message) for line in lines if line.name == "pose_gap"] == [(Log.WARNING, FINDING.message)]
    assert [line.message for line in lines if line.name == "vehicle"] == ["ready"]


def test_without_a_pose_nothing_is_drawn(tmp_path: Path, pairs: list[Pair]) -> None:
    inputs, tick = pairs[0]
    path = tmp_path / "blind.mcap"
    writer = LogWriter(path, synthetic_flight.header())
    writer.write(replace(inputs, pose=PoseReport(None, None)), tick)
    writer.close()
    assert not {"/pose", "/tf", "/reference"} & set(messages(path))


def test_the_description_comes_back(log: Path) -> None:
    header = read_log(log).header
    expected = synthetic_flight.header()
    for name in ("name", "mission_text", "vehicle", "limits", "link", "seed", "started", "planner", "model_card"):
        assert getattr(header, name) == getattr(expected, name), name
    assert header.predicted_max_error_m == 0.25
    assert header.predictions == (synthetic_flight.PREDICTION,)
    assert {"lcd-flight", "python", "system", "commit"} <= set(header.versions)
    for leg, wanted in zip(header.plan.legs, expected.plan.legs, strict=True):
        assert (leg.kind, leg.settle) == (wanted.kind, wanted.settle)
        assert (leg.trajectory.coefficients == wanted.trajectory.coefficients).all()
        assert (leg.trajectory.durations_s == wanted.trajectory.durations_s).all()
        assert (leg.baseline is None) == (wanted.baseline is None)
    tracking = header.plan.legs[2]
    assert tracking.waypoints is not None
    assert (tracking.waypoints == synthetic_flight.WAYPOINTS).all()


def test_what_a_flight_may_lack(tmp_path: Path, pairs: list[Pair]) -> None:
    header = synthetic_flight.header(
        predicted_max_error_m=None, predictions=(), model_card={}, notes={"operator": "a <b>", "name": "x"}
    )
    back = read_log(written(tmp_path / "bare.mcap", pairs[:1], header)).header
    assert back.predicted_max_error_m is None
    assert (back.model_card, back.predictions) == ({}, ())
    assert (back.notes["operator"], back.name) == ("a <b>", "four-waypoint test")


def test_equal_flights_make_equal_messages_whatever_the_day(tmp_path: Path, pairs: list[Pair]) -> None:
    other_day = synthetic_flight.header(started=datetime(2030, 1, 1, tzinfo=UTC), versions={"host": "elsewhere"})
    first, second = written(tmp_path / "1.mcap", pairs), written(tmp_path / "2.mcap", pairs, other_day)
    assert messages(first) == messages(second)


def test_the_description_is_on_the_disk_before_the_first_tick(tmp_path: Path) -> None:
    path = tmp_path / "early.mcap"
    with (
        closing(LogWriter(path, synthetic_flight.header())),
        pytest.raises(InputError, match="describes a flight but holds no tick"),
    ):
        read_log(path)


def test_an_open_log_lacks_at_most_half_a_second(tmp_path: Path, pairs: list[Pair]) -> None:
    path = tmp_path / "open.mcap"
    with closing(LogWriter(path, synthetic_flight.header())) as writer:
        for number, (inputs, tick) in enumerate(pairs[:200], start=1):
            writer.write(inputs, tick)
            if number % 37 == 0:
                kept = read_ticks(path)
                assert kept == pairs[: len(kept)]
                assert number - len(kept) <= 50


def test_slow_ticks_reach_the_disk_as_soon(tmp_path: Path, pairs: list[Pair]) -> None:
    """At 10 Hz a chunk would take seconds to fill: it is flushed by time."""
    path = tmp_path / "slow.mcap"
    with closing(LogWriter(path, synthetic_flight.header())) as writer:
        for number, (inputs, tick) in enumerate(pairs[:500:10], start=1):
            writer.write(inputs, tick)
            assert number - len(read_ticks(path)) <= 5


def test_disarming_reaches_the_disk_at_once(tmp_path: Path, pairs: list[Pair], monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    path = tmp_path / "disarmed.mcap"
    with closing(LogWriter(path, synthetic_flight.header())) as writer:
        assert len(synced) == 2  # the description, and the name in the folder
        for inputs, tick in pairs[-2:]:
            writer.write(inputs, tick)
        assert len(synced) == 3
        assert len(read_ticks(path)) == 2


@pytest.mark.parametrize("phase", [Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.KILL, Phase.CRASHED])
def test_giving_up_reaches_the_disk_once(
    tmp_path: Path, pairs: list[Pair], monkeypatch: pytest.MonkeyPatch, phase: Phase
) -> None:
    """A stop is asked for at every tick; the disk is waited for at the first."""
    stop = MotorRequest.STOP if phase in (Phase.KILL, Phase.CRASHED) else MotorRequest.NONE
    ending = [(i, replace(t, phase=phase, motors=stop)) for i, t in pairs[300:310]]
    synced: list[int] = []
    with closing(LogWriter(tmp_path / "given_up.mcap", synthetic_flight.header())) as writer:
        monkeypatch.setattr(os, "fsync", synced.append)
        for inputs, tick in (*pairs[290:300], *ending):
            writer.write(inputs, tick)
        assert len(synced) == 1


def test_a_log_is_never_overwritten(log: Path) -> None:
    with pytest.raises(RefusedError, match=r"cannot write the flight log .*flight\.mcap: File exists"):
        LogWriter(log, synthetic_flight.header())


def test_a_log_has_its_name_once_it_holds_the_description(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names: list[list[str]] = []
    monkeypatch.setattr(os, "fsync", lambda _: names.append([path.name for path in tmp_path.iterdir()]))
    with closing(LogWriter(tmp_path / "named.mcap", synthetic_flight.header())):
        assert names == [[".named.mcap.part"], ["named.mcap"]]


def test_a_log_that_cannot_be_begun_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RefusedError, match="No space left on device"):
        LogWriter(tmp_path / "full.mcap", synthetic_flight.header())
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_refuses_before_the_flight() -> None:
    full = Path("/dev/full").open("wb")  # noqa: SIM115 - closing it fails as well
    with pytest.raises(RefusedError, match=r"cannot write the flight log .*: No space left on device"):
        LogWriter(full, synthetic_flight.header())
    with contextlib.suppress(OSError):
        full.close()


def test_a_stream_is_written_too_and_left_open(pairs: list[Pair]) -> None:
    stream = io.BytesIO()
    writer = LogWriter(stream, synthetic_flight.header())
    writer.write(*pairs[0])
    writer.close()
    stream.seek(0)
    summary: Any = make_reader(stream).get_summary()
    assert summary.statistics.message_count > 4


def test_attachments_are_there_by_name(log: Path) -> None:
    with log.open("rb") as stream:
        files = {a.name: (a.media_type, a.data) for a in make_reader(stream).iter_attachments()}
    assert set(files) == {
        "mission.yaml",
        "plan.json",
        "prediction.json",
        "vehicle.json",
        "limits.json",
        "model_card.json",
    }
    assert files["mission.yaml"] == ("application/yaml", b"version: 1\nname: four-waypoint test\n")
    legs = msgspec.json.decode(files["plan.json"][1])
    assert [leg["kind"] for leg in legs] == ["takeoff", "hold", "trajectory", "land"]
    assert msgspec.json.decode(files["vehicle.json"][1])["mass_kg"] == 0.03
