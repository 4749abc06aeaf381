"""Options of the simulated MAVLink vehicle, faults included."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]
Milliseconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Flavour = Literal["px4", "ardupilot"]


class MavlinkOptions(msgspec.Struct, frozen=True):
    """Times of faults count from arming; None: the fault does not happen."""

    flavour: Flavour = "px4"
    system: Annotated[int, msgspec.Meta(ge=1, le=255)] = 1
    defaults: Literal["ready", "factory"] = "ready"
    """Parameters to begin with: set up for external poses, or as the firmware comes."""
    param_error: bool = False
    """Whether unknown parameters are answered with PARAM_ERROR, as firmware newer than 1.16 and 4.6 does."""
    boot_s: Seconds | None = None
    """Until it can be armed; None: 2 s, on ArduPilot 20 s."""
    hover_thrust: Annotated[float, msgspec.Meta(gt=0.0, lt=1.0)] | None = None
    """Thrust at which it truly hovers, 0 to 1; None: 0.5, on ArduPilot 0.369."""
    own_mocap: bool = False
    """Whether its estimator is fed by its own motion capture, without ODOMETRY from anybody."""
    rc: bool = False
    """Whether a pilot holds a remote control that is switched on."""
    key_file: str = ""
    """Where 32 bytes lie, or 64 hexadecimal digits, with which packets are signed; empty: no signing."""
    unsigned: bool = False
    """Whether it takes unsigned packets although it has a key, as ArduPilot does on its first channel."""

    mocap_yaw_deg: Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)] = 0.0
    """Where the x axis of motion capture truly points, counter-clockwise from east: 0 makes it ENU, 90 x north."""
    noise_mm: Annotated[float, msgspec.Meta(ge=0.001, le=1000.0)] = 0.3
    """Standard deviation of the published position, each axis. Never zero: a camera without noise looks frozen."""
    noise_deg: Annotated[float, msgspec.Meta(ge=0.0, le=90.0)] = 0.1
    """Of the published attitude, each axis."""
    twist: bool = True
    """Whether velocity and body rates are published beside the pose."""
    mocap_freeze_s: Seconds | None = None
    """When the published pose freezes; frames go on."""
    mocap_gap_s: Seconds | None = None
    """When no frames are published."""
    mocap_fault_ms: Milliseconds = 3000.0
    """How long a freeze or a gap lasts."""

    battery_V: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)] | None = None
    """A cell's voltage to start with; None: a full battery."""
    low_battery_s: Seconds | None = None
    """When the cell is nearly empty from one moment to the next."""
    drop: Share = 0.0
    """Share of datagrams lost, each way; `duplicate` and `reorder` likewise."""
    duplicate: Share = 0.0
    reorder: Share = 0.0
    delay_ms: Milliseconds = 0.0
    """Each way."""
    freeze_s: Seconds | None = None
    """When there is silence both ways; the vehicle lives on."""
    freeze_ms: Milliseconds = 3000.0
    """For how long."""
    mute_heartbeat_s: Seconds | None = None
    """When it stops sending heartbeats, and nothing else; 0: it never sends one."""
    foreign_system: Annotated[int, msgspec.Meta(ge=0, le=255)] = 0
    """Number of another vehicle whose heartbeats come in between; 0: none."""
    lose_ack: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 0
    """Command whose first acknowledgement is lost; 0: none."""
    reject: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 0
    """Command that is always rejected: DENIED; 0: none."""
    busy: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 0
    """Command that is TEMPORARILY_REJECTED the first time; 0: none."""
    slow: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 0
    """Command that is IN_PROGRESS for a second before it is done; 0: none."""
    wrong: str = ""
    """Parameters with other values, `NAME:VALUE,NAME:VALUE`."""
    stuck: str = ""
    """Parameters that do not hold what is written, `NAME,NAME`; the answer says that they do."""
    reboot_s: Seconds | None = None
    """When it reboots by itself."""
    pilot_s: Seconds | None = None
    """When the pilot acts."""
    pilot_act: str = "loiter"
    """What the pilot does: a mode's name, or `disarm`."""
    forge_s: Seconds | None = None
    """When somebody sends packets in its name that are signed with another key; 0: from the start."""
    replay_s: Seconds | None = None
    """When somebody sends again what it sent before; 0: from the start."""
    die_s: Seconds | None = None
    """When all power is lost."""
