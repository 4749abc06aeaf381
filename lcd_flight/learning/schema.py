"""The columns of a data set, in one table: what shards are written from, what the card and the documentation say."""

from __future__ import annotations

from dataclasses import dataclass

SCHEMA_VERSION = 2
"""2: yaw's way and crashes have columns of their own."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a shard."""

    name: str
    type: str
    """NumPy's name."""
    shape: str
    """Of one row's value, for S segments; nothing for one number."""
    unit: str
    meaning: str


_Z = "free knot variables, whitened (docs/method.md); 0 is minimum snap"
_THETA = "log-time variables; 0 is the paper's time allocation"
_PAPER = "sum over steps of |e_p|^2 + e_yaw^2, yaw wrapped: the paper's label"
_RELEASED = "the released code's label: sum of |e_p|^2 + |e_v|^2 + e_yaw^2, yaw not wrapped"
_VALID = "whether it stayed within the model's validity; where not, it ended there and the errors are those until then"

COLUMNS = (
    Column("task", "int64", "", "", "number of the task, drawn by (seed, number)"),
    Column("short_yaw", "bool", "", "", "whether the task turns by the short way rather than as sampled"),
    Column("source", "int8", "", "", "0 optimum, 1 random, 2 search, 3 given plan, 4 other times"),
    Column("z", "float32", "12 (S - 1)", "", _Z),
    Column("theta", "float32", "S", "", _THETA),
    Column("drag", "int8", "", "", "drag configuration, from 1"),
    Column("noise_seed", "uint64", "", "", "of the motor noise"),
    Column("max_error_m", "float32", "", "m", "largest position error"),
    Column("max_error_time_s", "float32", "", "s", "when that was, from the start"),
    Column("mean_error_m", "float32", "", "m", "mean position error"),
    Column("rms_error_m", "float32", "", "m", "root mean square of the position error"),
    Column("p8_error_m", "float32", "", "m", "eighth-power mean of the position error"),
    Column("segment_max_error_m", "float32", "S", "m", "largest position error of each segment; NaN: never reached"),
    Column("waypoint_error_m", "float32", "S + 1", "m", "distance from each waypoint at its time; NaN: never reached"),
    Column("yaw_cost", "float32", "", "", "mean of 2 (1 - cos e_yaw)"),
    Column("paper_cost", "float32", "", "m^2 + rad^2", _PAPER),
    Column("released_cost", "float32", "", "mixed", _RELEASED),
    Column("saturation_share", "float32", "", "", "share of motor commands that were clipped"),
    Column("longest_saturation_s", "float32", "", "s", "longest unbroken time with a motor clipped"),
    Column("valid", "bool", "", "", _VALID),
    Column("crashed", "bool", "", "", "largest position error above 1.5 m, or not valid"),
)
"""Errors are sampled once in a control step of 10 ms."""
