"""What stands around a flight, for 3-D viewers: fence, waypoints, planned paths, and the vehicle's body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive

from lcd_flight.model import FlightPlan, Geofence, Trajectory, Vehicle
from lcd_flight.model.frames import IDENTITY
from lcd_flight.model.types import Vector3
from lcd_flight.record import viewer

_PLANNED = Color(r=0.20, g=0.55, b=0.95, a=1.0)
_BASELINE = Color(r=0.95, g=0.60, b=0.15, a=0.8)
_WAYPOINT = Color(r=0.10, g=0.70, b=0.50, a=0.9)
_FENCE = Color(r=0.60, g=0.60, b=0.60, a=0.8)
_BODY = Color(r=0.30, g=0.30, b=0.35, a=1.0)
_FORWARD = Color(r=0.90, g=0.25, b=0.25, a=1.0)

_WAYPOINT_SIZE_M = 0.08
_LABEL_ABOVE_M = 0.12
_LINE_PX = 2.0


def flight_scene(stamp_ns: int, plan: FlightPlan, vehicle: Vehicle, fence: Geofence) -> SceneUpdate:
    """All of it; each entity stays until one of the same name replaces it."""
    scene = SceneUpdate()
    for entity in (_fence(fence), *_paths(plan), *_waypoints(plan), _body(vehicle)):
        entity.timestamp.CopyFrom(viewer.timestamp(stamp_ns))
        scene.entities.append(entity)
    return scene


def _fence(fence: Geofence) -> SceneEntity:
    """The twelve edges of the box."""
    (x0, y0, z0), (x1, y1, z1) = fence.low_m, fence.high_m
    along_x = [(x, y, z) for y in (y0, y1) for z in (z0, z1) for x in (x0, x1)]
    along_y = [(x, y, z) for x in (x0, x1) for z in (z0, z1) for y in (y0, y1)]
    along_z = [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
    edges = along_x + along_y + along_z
    return SceneEntity(id="geofence", frame_id=viewer.WORLD, lines=[_line(edges, _FENCE, LinePrimitive.LINE_LIST)])


def _paths(plan: FlightPlan) -> Iterator[SceneEntity]:
    """The planned path, and the minimum-snap plans that it is compared with."""
    baselines = [leg.baseline for leg in plan.legs if leg.baseline is not None]
    for name, color, trajectories in (
        ("planned path", _PLANNED, [plan.joined()]),
        ("minimum snap", _BASELINE, baselines),
    ):
        yield SceneEntity(id=name, frame_id=viewer.WORLD, lines=[_path(t, color) for t in trajectories])


def _waypoints(plan: FlightPlan) -> Iterator[SceneEntity]:
    """A ball and a number for each waypoint, counted from 1 through the whole flight."""
    points = [p for leg in plan.legs if leg.waypoints is not None for p in leg.waypoints[:, :3].tolist()]
    size = viewer.vector((_WAYPOINT_SIZE_M, _WAYPOINT_SIZE_M, _WAYPOINT_SIZE_M))
    for number, (x, y, z) in enumerate(points, start=1):
        yield SceneEntity(
            id=f"waypoint {number}",
            frame_id=viewer.WORLD,
            spheres=[SpherePrimitive(pose=viewer.pose((x, y, z), IDENTITY), size=size, color=_WAYPOINT)],
            texts=[
                TextPrimitive(
                    pose=viewer.pose((x, y, z + _LABEL_ABOVE_M), IDENTITY),
                    billboard=True,
                    font_size=14.0,
                    scale_invariant=True,
                    color=_WAYPOINT,
                    text=str(number),
                )
            ],
        )


def _body(vehicle: Vehicle) -> SceneEntity:
    """Arms, rotor discs and an arrow forward, fixed to the vehicle's frame."""
    reach_m = max(abs(component) for position in vehicle.rotor_positions_m for component in position)
    disc = viewer.vector((1.2 * reach_m, 1.2 * reach_m, 0.1 * reach_m))
    arms = [point for position in vehicle.rotor_positions_m for point in ((0.0, 0.0, 0.0), position)]
    return SceneEntity(
        id="vehicle",
        frame_id=viewer.VEHICLE,
        frame_locked=True,
        cylinders=[
            CylinderPrimitive(
                pose=viewer.pose(position, IDENTITY), size=disc, bottom_scale=1.0, top_scale=1.0, color=_BODY
            )
            for position in vehicle.rotor_positions_m
        ],
        lines=[_line(arms, _BODY, LinePrimitive.LINE_LIST)],
        arrows=[
            ArrowPrimitive(
                pose=viewer.pose((0.0, 0.0, 0.0), IDENTITY),
                shaft_length=1.5 * reach_m,
                shaft_diameter=0.1 * reach_m,
                head_length=0.5 * reach_m,
                head_diameter=0.3 * reach_m,
                color=_FORWARD,
            )
        ],
    )


def _path(trajectory: Trajectory, color: Color) -> LinePrimitive:
    return _line([(x, y, z) for x, y, z, _ in viewer.path_points(trajectory)], color, LinePrimitive.LINE_STRIP)


def _line(points: Sequence[Vector3], color: Color, kind: LinePrimitive.Type.ValueType) -> LinePrimitive:
    return LinePrimitive(
        type=kind,
        pose=viewer.pose((0.0, 0.0, 0.0), IDENTITY),
        thickness=_LINE_PX,
        scale_invariant=True,
        points=[Point3(x=x, y=y, z=z) for x, y, z in points],
        color=color,
    )
