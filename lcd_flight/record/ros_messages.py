"""Our records as ROS 2 messages: SI, `world` (z up) and `vehicle` (x forward, y left, z up), as REP 103 has them.

Message classes come out of a type store of `rosbags`; nothing of ROS is needed.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from lcd_flight.model import Quaternion, Severity, State, Trajectory, Vector3
from lcd_flight.model.frames import conjugate, from_yaw, rotate
from lcd_flight.record import viewer

_LEVELS = {
    Severity.INFO: "INFO",
    Severity.WARN: "WARN",
    Severity.BRAKE: "ERROR",
    Severity.LAND: "ERROR",
    Severity.DESCEND: "ERROR",
    Severity.KILL: "FATAL",
}


class RosMessages:
    """Makes messages. Stamps are nanoseconds since 1970."""

    def __init__(self, types: Any) -> None:
        """types: message classes by their full names, e.g. of `rosbags.typesys.Typestore`."""
        self._types = types

    def odometry(self, stamp_ns: int, state: State) -> Any:
        """Pose in the world, twist in the vehicle's frame (as the message has it); covariances zero: not known."""
        unknown = np.zeros(36)
        v_WB_B = rotate(conjugate(state.q_WB), state.v_WB_W)
        return self._new(
            "nav_msgs/msg/Odometry",
            header=self._header(stamp_ns),
            child_frame_id=viewer.VEHICLE,
            pose=self._new(
                "geometry_msgs/msg/PoseWithCovariance", pose=self._pose(state.p_WB, state.q_WB), covariance=unknown
            ),
            twist=self._new(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=self._new(
                    "geometry_msgs/msg/Twist", linear=self._vector(v_WB_B), angular=self._vector(state.w_WB_B)
                ),
                covariance=unknown,
            ),
        )

    def transform(self, stamp_ns: int, state: State) -> Any:
        """Where the vehicle's frame is."""
        placed = self._new(
            "geometry_msgs/msg/Transform", translation=self._vector(state.p_WB), rotation=self._quaternion(state.q_WB)
        )
        stamped = self._new(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(stamp_ns),
            child_frame_id=viewer.VEHICLE,
            transform=placed,
        )
        return self._new("tf2_msgs/msg/TFMessage", transforms=[stamped])

    def pose(self, stamp_ns: int, p_W: Vector3, q_W: Quaternion) -> Any:
        """A pose in the world."""
        return self._new("geometry_msgs/msg/PoseStamped", header=self._header(stamp_ns), pose=self._pose(p_W, q_W))

    def path(self, stamp_ns: int, trajectory: Trajectory) -> Any:
        """A planned path, a pose each 50 ms."""
        points: Iterable[Any] = viewer.path_points(trajectory)
        poses = [self.pose(stamp_ns, (x, y, z), from_yaw(yaw)) for x, y, z, yaw in points]
        return self._new("nav_msgs/msg/Path", header=self._header(stamp_ns), poses=poses)

    def attitude(self, stamp_ns: int, q_W: Quaternion) -> Any:
        """An attitude that was asked for."""
        return self._new(
            "geometry_msgs/msg/QuaternionStamped", header=self._header(stamp_ns), quaternion=self._quaternion(q_W)
        )

    def number(self, value: float) -> Any:
        """A number, in the unit that its topic says."""
        return self._new("std_msgs/msg/Float64", data=value)

    def text(self, text: str) -> Any:
        """A word."""
        return self._new("std_msgs/msg/String", data=text)

    def battery(self, stamp_ns: int, voltage_V: float) -> Any:
        """The voltage; all else is not known."""
        nan = float("nan")
        return self._new(
            "sensor_msgs/msg/BatteryState",
            header=self._header(stamp_ns),
            voltage=voltage_V,
            **dict.fromkeys(("temperature", "current", "charge", "capacity", "design_capacity", "percentage"), nan),
            power_supply_status=0,
            power_supply_health=0,
            power_supply_technology=0,
            present=True,
            cell_voltage=np.zeros(0, dtype=np.float32),
            cell_temperature=np.zeros(0, dtype=np.float32),
            location="",
            serial_number="",
        )

    def line(self, stamp_ns: int, severity: Severity, name: str, text: str) -> Any:
        """A line of the log."""
        kind = self._types["rcl_interfaces/msg/Log"]
        level = getattr(kind, _LEVELS[severity])
        return kind(stamp=self._time(stamp_ns), level=level, name=name, msg=text, file="", function="", line=0)

    def _new(self, name: str, **fields: Any) -> Any:
        return self._types[name](**fields)

    def _time(self, stamp_ns: int) -> Any:
        return self._new("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)

    def _header(self, stamp_ns: int) -> Any:
        return self._new("std_msgs/msg/Header", stamp=self._time(stamp_ns), frame_id=viewer.WORLD)

    def _pose(self, p_W: Vector3, q_W: Quaternion) -> Any:
        x, y, z = p_W
        point = self._new("geometry_msgs/msg/Point", x=x, y=y, z=z)
        return self._new("geometry_msgs/msg/Pose", position=point, orientation=self._quaternion(q_W))

    def _vector(self, v: Vector3) -> Any:
        return self._new("geometry_msgs/msg/Vector3", x=v[0], y=v[1], z=v[2])

    def _quaternion(self, q: Quaternion) -> Any:
        return self._new("geometry_msgs/msg/Quaternion", x=q[0], y=q[1], z=q[2], w=q[3])
