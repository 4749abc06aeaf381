"""From newtons to the share of full thrust that an autopilot takes. Pure."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ThrustMap:
    """Affine through the hover point: F / (m g) = 1 + slope (u / hover - 1).

    With slope 1 that is u = hover F / (m g), as PX4 takes it (thrust goes straight to the mixer, linear in force where
    `THR_MDL_FAC` fits). ArduCopter 4.6 was seen to give 0.824 g at 0.8 of hover and 1.172 g at 1.2: slope 0.87.
    """

    hover: float
    """Share of full thrust that carries the weight."""
    slope: float
    weight_N: float

    def share(self, thrust_N: float) -> float:
        """0 to 1; what is out of reach is the limit, and no thrust is none."""
        if thrust_N <= 0.0:
            return 0.0
        return min(max(self.hover * (1.0 + (thrust_N / self.weight_N - 1.0) / self.slope), 0.0), 1.0)

    def described(self) -> str:
        """For a person."""
        return f"hovers at {self.hover:.3f} of full thrust, slope {self.slope:g}"
