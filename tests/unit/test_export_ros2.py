"""`lcd export --ros2`: a bag that rosbags opens, and mcap's own ROS 2 decoder too."""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
import synthetic_flight

from lcd_flight.cli.main import app, run
from lcd_flight.model import Finding, InputError, RefusedError, Severity
from lcd_flight.model.frames import conjugate, rotate
from lcd_flight.record import LogWriter, ros_bag
from lcd_flight.record.ros_bag import TOPICS, write_bag

highlevel = pytest.importorskip("rosbags.highlevel", reason="the extra `ros2` is not installed")

FINDING = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)", 0.042, 0.3)
PAIRS = synthetic_flight.with_finding(synthetic_flight.flight(), 300, 305, FINDING)
STARTED_NS = round(synthetic_flight.header().started.timestamp() * 1e9)

Messages = dict[str, list[tuple[int, Any]]]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    log = folder / "flight.mcap"
    writer = LogWriter(log, synthetic_flight.header())
    for inputs, tick in PAIRS:
        writer.write(inputs, tick)
    writer.close()
    assert run(app, ["export", str(log), "--ros2", "--quiet"]) == 0
    return folder / "flight_ros2"


@pytest.fixture(scope="module")
def found(bag: Path) -> Messages:
    """All messages by topic with their times, as rosbags has them."""
    messages: Messages = defaultdict(list)
    with highlevel.AnyReader([bag]) as reader:
        for connection, stamp_ns, data in reader.messages():
            messages[connection.topic].append((stamp_ns, reader.deserialize(data, connection.msgtype)))
    return messages


def test_every_topic_of_the_table_is_there(bag: Path, found: Messages) -> None:
    with highlevel.AnyReader([bag]) as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == {t.name: t.message for t in TOPICS}
    assert set(found) == {topic.name for topic in TOPICS}


def test_stamps_are_the_time_of_day(found: Messages) -> None:
    times = [stamp_ns for stamp_ns, _ in found["/odometry"]]
    assert times[0] == STARTED_NS
    assert times[-1] - times[0] == PAIRS[-1][1].now_ns - PAIRS[0][1].now_ns
    header = found["/odometry"][10][1].header
    assert header.stamp.sec * 10**9 + header.stamp.nanosec == times[10]


def test_the_vehicle_is_where_it_was_and_its_twist_in_its_own_frame(found: Messages) -> None:
    odometry, state = found["/odometry"][400][1], PAIRS[400][0].pose.state
    assert state is not None
    position, linear = odometry.pose.pose.position, odometry.twist.twist.linear
    assert (position.x, position.y, position.z) == state.p_WB
    assert (linear.x, linear.y, linear.z) == pytest.approx(rotate(conjugate(state.q_WB), state.v_WB_W))
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("world", "vehicle")
    transform = found["/tf"][400][1].transforms[0]
    assert (transform.transform.rotation.w, transform.transform.translation.x) == (state.q_WB[3], state.p_WB[0])


def test_setpoints_are_those_that_were_sent(found: Messages) -> None:
    sent = [tick.setpoint for _, tick in PAIRS if tick.setpoint is not None]
    assert [message.data for _, message in found["/setpoint/thrust"]] == [setpoint.thrust_N for setpoint in sent]
    q = found["/setpoint/attitude"][200][1].quaternion
    assert (q.x, q.y, q.z, q.w) == sent[200].q_WB


def test_words_are_told_once(found: Messages) -> None:
    assert [m.data for _, m in found["/phase"]] == ["preflight", "armed", "takeoff", "hold", "track", "land", "landed"]
    lines = [(m.name, m.msg, m.level) for _, m in found["/rosout"]]
    assert lines == [("vehicle", "ready", 20), ("pose_gap", FINDING.message, 30)]


def test_the_plans(found: Messages) -> None:
    ((_, plan),), ((_, baseline),) = found["/plan"], found["/minimum_snap"]
    end = synthetic_flight.WAYPOINTS[-1]
    assert (plan.poses[-1].pose.position.x, plan.poses[-1].pose.position.y) == pytest.approx((end[0], end[1]))
    assert len(baseline.poses) > 50


def test_another_decoder_reads_the_same(bag: Path, found: Messages) -> None:
    decoder = pytest.importorskip("mcap_ros2.decoder")
    from mcap.reader import make_reader

    with next(bag.glob("*.mcap")).open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[decoder.DecoderFactory()])
        poses = [m.pose.position.z for _, _, _, m in reader.iter_decoded_messages(topics=["/reference"])]
    assert poses == [message.pose.position.z for _, message in found["/reference"]]


def test_the_description_comes_along(bag: Path) -> None:
    text = (bag / "metadata.yaml").read_text()
    assert "flight.name: four-waypoint test" in text
    assert "flight.planner: learned" in text


def test_the_documentation_has_the_same_table() -> None:
    text = (Path(__file__).parents[2] / "docs" / "flight_log.md").read_text(encoding="utf-8")
    for topic in TOPICS:
        assert f"| `{topic.name}` | `{topic.message}` | {topic.rate} | {topic.units} |" in text


# What goes wrong


def test_nothing_is_overwritten(bag: Path) -> None:
    with pytest.raises(InputError, match="exists already; remove it or choose another name with --out"):
        write_bag(bag, synthetic_flight.header(), PAIRS)


def test_an_interruption_leaves_no_bag(tmp_path: Path) -> None:
    def interrupt(_count: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_bag(tmp_path / "bag", synthetic_flight.header(), PAIRS, interrupt)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RefusedError, match="cannot be written: Not a directory"):
        write_bag(tmp_path / "file" / "bag", synthetic_flight.header(), PAIRS)


def test_without_rosbags_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(RefusedError, match=r"pip install 'lcd-flight\[ros2\]'"):
        ros_bag.write_bag(tmp_path / "bag", synthetic_flight.header(), PAIRS)


def test_a_form_must_be_chosen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["export", str(tmp_path / "flight.mcap"), "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"] == "nothing to export: choose --ros2"
