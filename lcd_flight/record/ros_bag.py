"""A flight log as a ROS 2 bag, for those who live among ROS tools; written by `rosbags`, without ROS."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from lcd_flight.model import FlightPlan, InputError, RefusedError, Severity, Tick, TickInputs
from lcd_flight.model.frames import from_yaw
from lcd_flight.record.container import Advance, unwatched
from lcd_flight.record.header import FlightHeader, metadata
from lcd_flight.record.ros_messages import RosMessages

VERSION: Final = 8
"""Of the bag's description; 9 writes QoS in a form that ROS before Jazzy does not read."""


@dataclass(frozen=True, slots=True)
class RosTopic:
    """One row of the table."""

    name: str
    message: str
    rate: str
    units: str


ODOMETRY = RosTopic("/odometry", "nav_msgs/msg/Odometry", "every tick with a pose", "m, m/s, rad/s; twist in `vehicle`")
TF = RosTopic("/tf", "tf2_msgs/msg/TFMessage", "every tick with a pose", "m; world to vehicle")
MOCAP = RosTopic("/mocap", "geometry_msgs/msg/PoseStamped", "every new frame", "m; as it was received, at its arrival")
REFERENCE = RosTopic("/reference", "geometry_msgs/msg/PoseStamped", "every tick with a reference", "m; heading, level")
ATTITUDE = RosTopic("/setpoint/attitude", "geometry_msgs/msg/QuaternionStamped", "every tick that sends", "as sent")
THRUST = RosTopic("/setpoint/thrust", "std_msgs/msg/Float64", "every tick that sends", "N, collective")
BATTERY = RosTopic("/battery", "sensor_msgs/msg/BatteryState", "every tick that knows it", "V")
PHASE = RosTopic("/phase", "std_msgs/msg/String", "on change", "value of `Phase`")
ROSOUT = RosTopic("/rosout", "rcl_interfaces/msg/Log", "on change", "findings as they begin, the vehicle's messages")
PLAN = RosTopic("/plan", "nav_msgs/msg/Path", "once", "m; the planned path")
BASELINE = RosTopic("/minimum_snap", "nav_msgs/msg/Path", "once for each trajectory", "m; the plan compared with")

TOPICS = (ODOMETRY, TF, MOCAP, REFERENCE, ATTITUDE, THRUST, BATTERY, PHASE, ROSOUT, PLAN, BASELINE)

Stamped = tuple[RosTopic, int, Any]
"""A topic, nanoseconds since 1970, and a message."""


def write_bag(
    folder: Path,
    header: FlightHeader,
    flight: Sequence[tuple[TickInputs, Tick]],
    advance: Advance = unwatched,
) -> None:
    """Write a bag (`folder` with an MCAP file and metadata.yaml); after an error or Ctrl-C there is none.

    advance: told how many ticks more were written.

    Raises:
        InputError: `folder` exists already.
        RefusedError: it cannot be written, or `rosbags` is not installed.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise RefusedError("ROS 2 bags need the package rosbags: pip install 'lcd-flight[ros2]'") from error
    if folder.exists():
        raise InputError(f"{folder}: exists already; remove it or choose another name with --out")
    store = get_typestore(Stores.ROS2_HUMBLE)
    try:
        with Writer(folder, version=VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
            for name, values in metadata(header).items():
                for key, value in values.items():
                    writer.set_custom_data(f"{name}.{key}", value)
            connections = {t.name: writer.add_connection(t.name, t.message, typestore=store) for t in TOPICS}
            for topic, stamp_ns, message in _messages(RosMessages(store.types), header, flight, advance):
                writer.write(connections[topic.name], stamp_ns, store.serialize_cdr(message, topic.message))
    except OSError as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise RefusedError(f"{folder}: cannot be written: {error.strerror}; choose another place with --out") from error
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _messages(
    ros: RosMessages,
    header: FlightHeader,
    flight: Sequence[tuple[TickInputs, Tick]],
    advance: Advance,
) -> Iterator[Stamped]:
    """The flight in order. Time of day is that of the log's beginning plus the host's monotonic time since."""
    offset_ns = round(header.started.timestamp() * 1e9) - flight[0][1].now_ns
    yield from _plans(ros, header.plan, flight[0][1].now_ns + offset_ns)
    before: tuple[TickInputs, Tick] | None = None
    for inputs, tick in flight:
        stamp_ns = tick.now_ns + offset_ns
        yield from _seen(ros, inputs, before, stamp_ns, offset_ns)
        yield from _decided(ros, tick, stamp_ns)
        yield from _told(ros, inputs, tick, before, stamp_ns)
        before = (inputs, tick)
        advance(1)


def _plans(ros: RosMessages, plan: FlightPlan, stamp_ns: int) -> Iterator[Stamped]:
    yield PLAN, stamp_ns, ros.path(stamp_ns, plan.joined())
    for leg in plan.legs:
        if leg.baseline is not None:
            yield BASELINE, stamp_ns, ros.path(stamp_ns, leg.baseline)


def _seen(
    ros: RosMessages, inputs: TickInputs, before: tuple[TickInputs, Tick] | None, stamp_ns: int, offset_ns: int
) -> Iterator[Stamped]:
    """What the tick knew."""
    raw, last = inputs.pose.raw, None if before is None else before[0].pose.raw
    if raw is not None and raw != last:
        yield MOCAP, raw.arrival_ns + offset_ns, ros.pose(raw.arrival_ns + offset_ns, raw.p_WB, raw.q_WB)
    if inputs.pose.state is not None:
        yield ODOMETRY, stamp_ns, ros.odometry(stamp_ns, inputs.pose.state)
        yield TF, stamp_ns, ros.transform(stamp_ns, inputs.pose.state)
    telemetry = inputs.link.telemetry
    if telemetry is not None and telemetry.battery_V is not None:
        yield BATTERY, stamp_ns, ros.battery(stamp_ns, telemetry.battery_V)


def _decided(ros: RosMessages, tick: Tick, stamp_ns: int) -> Iterator[Stamped]:
    """What it decided."""
    if tick.reference is not None:
        yield REFERENCE, stamp_ns, ros.pose(stamp_ns, tick.reference.p_W, from_yaw(tick.reference.yaw_rad))
    if tick.setpoint is not None:
        yield ATTITUDE, stamp_ns, ros.attitude(stamp_ns, tick.setpoint.q_WB)
        yield THRUST, stamp_ns, ros.number(tick.setpoint.thrust_N)


def _told(
    ros: RosMessages, inputs: TickInputs, tick: Tick, before: tuple[TickInputs, Tick] | None, stamp_ns: int
) -> Iterator[Stamped]:
    """What is new in words."""
    if before is None or before[1].phase is not tick.phase:
        yield PHASE, stamp_ns, ros.text(tick.phase.value)
    known = set() if before is None else {finding.code for finding in before[1].findings}
    for finding in tick.findings:
        if finding.code not in known:
            yield ROSOUT, stamp_ns, ros.line(stamp_ns, finding.severity, finding.code, finding.message)
    telemetry = inputs.link.telemetry
    for text in () if telemetry is None else telemetry.messages:
        yield ROSOUT, stamp_ns, ros.line(stamp_ns, Severity.INFO, "vehicle", text)
