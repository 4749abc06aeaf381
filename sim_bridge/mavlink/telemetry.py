"""What the autopilot says of itself, message by message, and how often."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink.ardupilot import ArduPilot
from sim_bridge.mavlink.autopilot import Autopilot
from sim_bridge.mavlink.frames import angles, inverse, turn
from sim_bridge.mavlink.px4 import Px4

NAN = math.nan
ARMED, CUSTOM, STABILIZES, GUIDED = 128, 1, 16, 8
EKF_STATUS_REPORT = 193
_UNKNOWN_COVARIANCE = [NAN] + [0.0] * 20
NO_CELL = 65535


def boot_ms(pilot: Autopilot) -> int:
    """Time since the boot, as most messages have it."""
    return (pilot.now_ns - pilot.boot_ns) // 1_000_000 % 2**32


def boot_us(pilot: Autopilot) -> int:
    """Likewise, in us."""
    return (pilot.now_ns - pilot.boot_ns) // 1000


def is_px4(pilot: Autopilot) -> bool:
    """Which flavour it is."""
    return isinstance(pilot, Px4)


def heartbeat(pilot: Autopilot) -> Any:
    """HEARTBEAT."""
    maker = common.MAV_AUTOPILOT_PX4 if is_px4(pilot) else common.MAV_AUTOPILOT_ARDUPILOTMEGA
    base = CUSTOM | STABILIZES | GUIDED | (ARMED if pilot.armed else 0)
    if pilot.body.broken or pilot.failsafe:
        status = common.MAV_STATE_CRITICAL
    elif pilot.age_s < pilot.setup.boot_s:
        status = common.MAV_STATE_BOOT if is_px4(pilot) else common.MAV_STATE_STANDBY
    else:
        status = common.MAV_STATE_ACTIVE if pilot.armed else common.MAV_STATE_STANDBY
    return common.MAVLink_heartbeat_message(common.MAV_TYPE_QUADROTOR, maker, base, pilot.mode, status, 3)


def attitude(pilot: Autopilot) -> Any:
    """ATTITUDE."""
    estimate = pilot.estimator
    return common.MAVLink_attitude_message(boot_ms(pilot), *angles(estimate.attitude), *estimate.rates)


def attitude_quaternion(pilot: Autopilot) -> Any:
    """ATTITUDE_QUATERNION."""
    estimate = pilot.estimator
    return common.MAVLink_attitude_quaternion_message(boot_ms(pilot), *estimate.attitude, *estimate.rates)


def local_position_ned(pilot: Autopilot) -> Any | None:
    """LOCAL_POSITION_NED; nothing without a position."""
    if not pilot.has_position:
        return None
    estimate = pilot.estimator
    return common.MAVLink_local_position_ned_message(boot_ms(pilot), *estimate.position, *estimate.velocity)


def odometry(pilot: Autopilot) -> Any | None:
    """ODOMETRY; nothing without a position."""
    if not pilot.has_position:
        return None
    estimate = pilot.estimator
    velocity_B = turn(inverse(estimate.attitude), estimate.velocity)
    return common.MAVLink_odometry_message(
        boot_us(pilot),
        common.MAV_FRAME_LOCAL_NED,
        common.MAV_FRAME_BODY_FRD,
        *estimate.position,
        list(estimate.attitude),
        *velocity_B,
        *estimate.rates,
        _UNKNOWN_COVARIANCE,
        _UNKNOWN_COVARIANCE,
        0,
        common.MAV_ESTIMATOR_TYPE_AUTOPILOT,
        0,
    )


def attitude_target(pilot: Autopilot) -> Any | None:
    """ATTITUDE_TARGET: what was taken last."""
    target = pilot.target
    if target is None:
        return None
    return common.MAVLink_attitude_target_message(
        boot_ms(pilot), 0, list(target.attitude), 0.0, 0.0, 0.0, target.thrust
    )


def sys_status(pilot: Autopilot) -> Any:
    """SYS_STATUS."""
    sensors = 0x1 | 0x2 | 0x20000 | 0x200000 | (0x80 if pilot.has_position else 0)
    present = sensors | 0x80
    return common.MAVLink_sys_status_message(
        present,
        present,
        sensors,
        100,
        round(1000.0 * pilot.body.battery_V),
        -1,
        round(100.0 * pilot.body.battery_share),
        *(0,) * 6,
    )


def battery_status(pilot: Autopilot) -> Any:
    """BATTERY_STATUS, of one cell."""
    cells = [round(1000.0 * pilot.body.battery_V)] + [NO_CELL] * 9
    share = pilot.body.battery_share
    state = common.MAV_BATTERY_CHARGE_STATE_OK if share > 0.15 else common.MAV_BATTERY_CHARGE_STATE_LOW
    return common.MAVLink_battery_status_message(
        0, 0, common.MAV_BATTERY_TYPE_LIPO, 32767, cells, -1, -1, -1, round(100.0 * share), 0, state
    )


def extended_sys_state(pilot: Autopilot) -> Any:
    """EXTENDED_SYS_STATE: on the ground, in the air, landing."""
    flying = common.MAV_LANDED_STATE_LANDING if pilot.landing and pilot.armed else common.MAV_LANDED_STATE_IN_AIR
    state = common.MAV_LANDED_STATE_ON_GROUND if pilot.landed else flying
    return common.MAVLink_extended_sys_state_message(common.MAV_VTOL_STATE_UNDEFINED, state)


def estimator_status(pilot: Autopilot) -> Any:
    """ESTIMATOR_STATUS."""
    estimate = pilot.estimator
    flags = 0x33F if pilot.has_position else 0x85
    accuracy = min(100.0, 0.01 + 0.1 * estimate.age_s(pilot.now_ns))
    ratio = estimate.ratio
    return common.MAVLink_estimator_status_message(
        boot_us(pilot), flags, ratio, ratio, ratio, 0.0, NAN, NAN, accuracy, accuracy
    )


def ekf_status_report(pilot: Autopilot) -> Any:
    """EKF_STATUS_REPORT, which only ArduPilot's dialect has."""
    from pymavlink.dialects.v20.ardupilotmega import MAVLink_ekf_status_report_message

    flags = pilot.flags if isinstance(pilot, ArduPilot) else 0
    ratio = pilot.estimator.ratio
    return MAVLink_ekf_status_report_message(flags, ratio, ratio, ratio, 0.0, 0.0)


def home_position(pilot: Autopilot) -> Any | None:
    """HOME_POSITION: the origin, once it is known."""
    if not pilot.has_position:
        return None
    latitude, longitude, altitude = (pilot.origin if isinstance(pilot, ArduPilot) else None) or (0, 0, 0)
    nowhere = [1.0, 0.0, 0.0, 0.0]
    return common.MAVLink_home_position_message(
        latitude, longitude, altitude, 0.0, 0.0, 0.0, nowhere, 0.0, 0.0, 0.0, boot_us(pilot)
    )


def gps_global_origin(pilot: Autopilot) -> Any | None:
    """GPS_GLOBAL_ORIGIN, once it is set."""
    origin = pilot.origin if isinstance(pilot, ArduPilot) else None
    return None if origin is None else common.MAVLink_gps_global_origin_message(*origin, boot_us(pilot))


def autopilot_version(pilot: Autopilot) -> Any:
    """AUTOPILOT_VERSION."""
    px4 = is_px4(pilot)
    coding = 16 if px4 else 131072
    capabilities = 2 | coding | 8 | 64 | 2048 | 8192
    version = (1 << 24 | 16 << 16 | 255) if px4 else (4 << 24 | 6 << 16 | 3 << 8 | 255)
    return common.MAVLink_autopilot_version_message(
        capabilities, version, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0x5349_4D55_4C41_5445
    )


def timesync(pilot: Autopilot) -> Any:
    """TIMESYNC: asking for the other's clock."""
    return common.MAVLink_timesync_message(0, pilot.now_ns - pilot.boot_ns)


Builder = Callable[[Autopilot], Any]
BUILDERS: dict[int, Builder] = {
    common.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    common.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    common.MAVLINK_MSG_ID_ATTITUDE: attitude,
    common.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: attitude_quaternion,
    common.MAVLINK_MSG_ID_LOCAL_POSITION_NED: local_position_ned,
    common.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: gps_global_origin,
    common.MAVLINK_MSG_ID_ATTITUDE_TARGET: attitude_target,
    common.MAVLINK_MSG_ID_TIMESYNC: timesync,
    common.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    common.MAVLINK_MSG_ID_AUTOPILOT_VERSION: autopilot_version,
    common.MAVLINK_MSG_ID_HOME_POSITION: home_position,
    common.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
    common.MAVLINK_MSG_ID_ODOMETRY: odometry,
}
"""Both flavours'; SYSTEM_TIME is the firmware's, which knows the date."""
PX4_BUILDERS: dict[int, Builder] = {**BUILDERS, common.MAVLINK_MSG_ID_ESTIMATOR_STATUS: estimator_status}
ARDUPILOT_BUILDERS: dict[int, Builder] = {**BUILDERS, EKF_STATUS_REPORT: ekf_status_report}

PX4_RATES = {
    common.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    common.MAVLINK_MSG_ID_SYS_STATUS: 5.0,
    common.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    common.MAVLINK_MSG_ID_ATTITUDE: 50.0,
    common.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50.0,
    common.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
    common.MAVLINK_MSG_ID_ATTITUDE_TARGET: 10.0,
    common.MAVLINK_MSG_ID_TIMESYNC: 10.0,
    common.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    common.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 5.0,
    common.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    common.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    common.MAVLINK_MSG_ID_ODOMETRY: 30.0,
}
"""Hz after a boot (PX4, mavlink_main.cpp, MAVLINK_MODE_ONBOARD, what is simulated of it)."""
ARDUPILOT_RATES = {common.MAVLINK_MSG_ID_HEARTBEAT: 1.0, common.MAVLINK_MSG_ID_TIMESYNC: 0.1}
"""Hz after a boot: the rest is to be asked for."""
