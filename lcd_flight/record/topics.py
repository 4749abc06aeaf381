"""The one table of what a flight log holds: topic, schema, when it is written, and what its numbers mean.

`log_time` is the host's monotonic clock at the tick; `publish_time` is the source's own stamp where there is one.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import msgspec
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from lcd_flight.model import Tick, TickInputs
from lcd_flight.record import schema, viewer


@dataclass(frozen=True, slots=True)
class Topic:
    """One row of the table."""

    name: str
    message: type
    """A dataclass of ours, written as JSON, or a protobuf message class of Foxglove's."""
    rate: str
    units: str

    @property
    def encoding(self) -> str:
        """Of the messages, as MCAP's registry calls it."""
        return "json" if dataclasses.is_dataclass(self.message) else "protobuf"

    @property
    def schema_encoding(self) -> str:
        """As MCAP's registry calls it."""
        return "jsonschema" if self.encoding == "json" else "protobuf"

    @property
    def schema_name(self) -> str:
        """E.g. `lcd_flight.Tick` or `foxglove.PoseInFrame`."""
        if self.encoding == "json":
            return f"lcd_flight.{self.message.__name__}"
        return str(self.message.DESCRIPTOR.full_name)  # type: ignore[attr-defined]

    def schema_data(self) -> bytes:
        """The schema itself, generated."""
        if self.encoding == "json":
            return msgspec.json.encode(schema.json_schema(self.message))
        return viewer.descriptor_set(self.message)


TICK_INPUTS = Topic("/tick_inputs", TickInputs, "every tick", "SI, rad, ns; world z up, quaternions xyzw")
TICK = Topic("/tick", Tick, "every tick", "SI, rad, ns; world z up, quaternions xyzw")
TRANSFORMS = Topic("/tf", FrameTransforms, "every tick with a pose", "m; world to vehicle")
POSE = Topic("/pose", PoseInFrame, "every tick with a pose", "m; filtered; published at the source's stamp")
REFERENCE = Topic("/reference", PoseInFrame, "every tick with a reference", "m; position and heading, level")
PLAN = Topic("/plan", PosesInFrame, "once, at the first tick", "m; the planned path, a pose each 50 ms")
SCENE = Topic("/scene", SceneUpdate, "once, at the first tick", "m; fence, waypoints, planned paths, vehicle")
LOG = Topic("/log", Log, "on change", "findings as they begin, phases, the vehicle's own messages")

TOPICS = (TICK_INPUTS, TICK, TRANSFORMS, POSE, REFERENCE, PLAN, SCENE, LOG)
