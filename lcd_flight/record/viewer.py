"""What viewers draw with no set-up: our ticks as Foxglove's protobuf messages.

Frames: `world` (z up) and `vehicle` (x forward, y left, z up). Nothing is read back from these messages; the exact
record of a tick is the JSON of `lcd_flight.wire.json_records`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion as FoxgloveQuaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3 as FoxgloveVector3
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp

from lcd_flight.model import Finding, Reference, Severity, State, Trajectory
from lcd_flight.model.frames import from_yaw
from lcd_flight.model.types import Quaternion, Vector3

WORLD = "world"
VEHICLE = "vehicle"

_PATH_STEP_S = 0.05

_LEVELS = {
    Severity.INFO: Log.INFO,
    Severity.WARN: Log.WARNING,
    Severity.BRAKE: Log.ERROR,
    Severity.LAND: Log.ERROR,
    Severity.DESCEND: Log.ERROR,
    Severity.KILL: Log.FATAL,
}


def timestamp(stamp_ns: int) -> Timestamp:
    """Nanoseconds since the clock's own zero."""
    return Timestamp(seconds=stamp_ns // 1_000_000_000, nanos=stamp_ns % 1_000_000_000)


def pose(p_W: Vector3, q_W: Quaternion) -> Pose:
    """A position in m and an attitude (xyzw)."""
    return Pose(position=vector(p_W), orientation=quaternion(q_W))


def vector(v: Vector3) -> FoxgloveVector3:
    """Three components."""
    return FoxgloveVector3(x=v[0], y=v[1], z=v[2])


def quaternion(q: Quaternion) -> FoxgloveQuaternion:
    """A rotation, xyzw."""
    return FoxgloveQuaternion(x=q[0], y=q[1], z=q[2], w=q[3])


def transforms(stamp_ns: int, state: State) -> FrameTransforms:
    """Where the vehicle's frame is, so that what is fixed to it moves."""
    transform = FrameTransform(
        timestamp=timestamp(stamp_ns),
        parent_frame_id=WORLD,
        child_frame_id=VEHICLE,
        translation=vector(state.p_WB),
        rotation=quaternion(state.q_WB),
    )
    return FrameTransforms(transforms=[transform])


def vehicle_pose(stamp_ns: int, state: State) -> PoseInFrame:
    """The filtered pose."""
    return PoseInFrame(timestamp=timestamp(stamp_ns), frame_id=WORLD, pose=pose(state.p_WB, state.q_WB))


def reference_pose(stamp_ns: int, reference: Reference) -> PoseInFrame:
    """Where the vehicle should be: position and heading, level."""
    where = pose(reference.p_W, from_yaw(reference.yaw_rad))
    return PoseInFrame(timestamp=timestamp(stamp_ns), frame_id=WORLD, pose=where)


def path_poses(stamp_ns: int, trajectory: Trajectory) -> PosesInFrame:
    """A planned path as poses, one each 50 ms."""
    return PosesInFrame(
        timestamp=timestamp(stamp_ns),
        frame_id=WORLD,
        poses=[pose((x, y, z), from_yaw(yaw)) for x, y, z, yaw in path_points(trajectory)],
    )


def path_points(trajectory: Trajectory) -> list[tuple[float, float, float, float]]:
    """x, y, z in m and yaw in rad along a trajectory, both ends included, at most 50 ms apart."""
    duration_s = trajectory.duration_s
    times_s = np.linspace(0.0, duration_s, math.ceil(duration_s / _PATH_STEP_S) + 1)
    return [tuple(point) for point in trajectory.derivative(times_s, 0).tolist()]


def finding_line(stamp_ns: int, finding: Finding) -> Log:
    """A finding for the log panel."""
    return Log(
        timestamp=timestamp(stamp_ns), level=_LEVELS[finding.severity], message=finding.message, name=finding.code
    )


def text_line(stamp_ns: int, name: str, message: str) -> Log:
    """A line of plain information; `name`: where it comes from."""
    return Log(timestamp=timestamp(stamp_ns), level=Log.INFO, message=message, name=name)


def descriptor_set(message: type[Message]) -> bytes:
    """A message class as MCAP wants its schema: its file and all that it imports, dependencies first."""
    found: dict[str, FileDescriptorProto] = {}

    def collect(file: Any) -> None:
        for dependency in file.dependencies:
            collect(dependency)
        if file.name not in found:
            found[file.name] = FileDescriptorProto()
            file.CopyToProto(found[file.name])

    collect(message.DESCRIPTOR.file)
    return FileDescriptorSet(file=found.values()).SerializeToString()
