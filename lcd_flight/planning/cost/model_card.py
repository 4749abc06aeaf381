"""What a model of the tracking cost is good for and where it comes from: the card inside every model file."""

from __future__ import annotations

from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from lcd_flight.model import Loop, Vector3

CurvePoint: TypeAlias = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
"""Rollouts learned from so far, mean training loss since the last point, loss on held-out tasks."""
CalibrationBin: TypeAlias = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]
"""Mean predicted cost of a bin; 10 %, median and 90 % of the measured; how many rollouts."""


class ModelCard(BaseModel):
    """Written by training, read wherever the model is used."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1)
    vehicle: str
    """The vehicle's name, for messages."""
    vehicle_fingerprint: str
    """Of all that matters about the vehicle (`lcd_flight.worlds`); what a mission's vehicle is compared with."""
    loop: Loop
    worlds: tuple[str, ...]
    """What the data come from, with the version of each: `crazyflie-paper v1`."""
    parasitic_drag: tuple[Vector3, ...]
    """c_D in N/(m/s)^2 of each drag configuration in the data."""
    speeds: tuple[FiniteFloat, ...]
    """m/s of the tasks in the data, for each world."""
    rollouts: int
    """How many it was trained on."""
    data_hash: str
    """Of the configuration of the data and the training."""
    snap_weight: FiniteFloat
    """The planner's weight of the extra snap that suits this model."""
    validation: dict[str, FiniteFloat]
    """Figures on tasks that were held out, by name."""
    target: Literal["error", "released"] = "error"
    """What is predicted, as a logarithm: the largest error, or the released code's label."""
    learning_curve: tuple[CurvePoint, ...] = ()
    """Of the first member, in the last round."""
    calibration: dict[str, tuple[CalibrationBin, ...]] = {}
    """Measured against predicted cost on held-out tasks: of `optima`, and of plans that were `planned`."""
    versions: dict[str, str]
    """Of the packages that made it."""
