"""The one import of pymavlink's generated dialect; everything else of pymavlink stays out.

`ardupilotmega` is `common` with ArduPilot's own messages: EKF_STATUS_REPORT, by which its estimator is judged, is in no
other. Importing it takes as long as importing `common` (some 50 ms); mavutil takes far longer and is not needed.
"""

from __future__ import annotations

import os
from typing import Any, TypeAlias

os.environ.setdefault("MAVLINK20", "1")
os.environ.setdefault("MAVLINK_DIALECT", "ardupilotmega")

from pymavlink.dialects.v20 import ardupilotmega as mavlink

mavlink.MAVLINK_IGNORE_CRC = 0  # whatever the user's environment says

Message: TypeAlias = Any
"""A message of the dialect; pymavlink's classes are untyped to us."""

__all__ = ["Message", "mavlink"]
