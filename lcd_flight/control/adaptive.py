"""The geometric law with an L1 adaptive estimate of the force that the model leaves out: MS-GCD without a drag model.

A predictor of the velocity runs beside the vehicle; what it lacks is a force. With v~ = v_hat - v, A < 0, period T:

    sigma = -m A e^{AT} / (e^{AT} - 1) v~             the force that explains v~ within one period (piecewise constant)
    found += (1 - e^{-w_c T}) (sigma - found)         only its slow part is acted on, |found| <= m g / 2
    v_hat += T (-g e3 + (u R e3 + sigma) / m + A v~)  u: the thrust that is asked for

Of a steady force it finds e^{AT}, 95 % at 100 Hz. All in the world; the law's force is that of `geometric` minus
`found`. While motors saturate and on the ground `found` stays as it is; a flight starts from `AT_REST` at arming. The
paper's released code has a low-pass that changes sign with every step, adds an estimate in the body to a force in the
world, and counts it twice; this is the law it means. Scalars and `math` only.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lcd_flight.control.geometric import clipped, dot, scaled
from lcd_flight.model.types import GRAVITY_M_PER_S2, Vector3

POLE = -5.0
"""1/s, A: how fast an error of the predictor dies out."""
BANDWIDTH = 10.0
"""rad/s, w_c: how fast the law acts on what is found."""
LARGEST_SHARE = 0.5
"""Of the weight, the most that is ever found."""


class Adaptation(NamedTuple):
    """The estimator's constants for one vehicle and one period."""

    mass_kg: float
    period_s: float
    gain: float
    """N s/m, force for an error of the predicted velocity."""
    share: float
    """Of a new estimate that is taken over in one period."""
    limit_N: float


class Estimate(NamedTuple):
    """What the estimator remembers; world."""

    velocity: Vector3
    """m/s, predicted."""
    found: Vector3
    """N, the force that acts besides thrust and weight."""


AT_REST = Estimate((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def adaptation(mass_kg: float, dt_s: float, nominal_dt_s: float) -> Adaptation:
    """The constants for a period as measured, held within half and twice the nominal one."""
    period_s = clipped(dt_s, 0.5 * nominal_dt_s, 2.0 * nominal_dt_s)
    fading = math.exp(POLE * period_s)
    gain = -mass_kg * POLE * fading / (fading - 1.0)
    share = 1.0 - math.exp(-BANDWIDTH * period_s)
    return Adaptation(mass_kg, period_s, gain, share, LARGEST_SHARE * mass_kg * GRAVITY_M_PER_S2)


def found_force(estimate: Estimate, v_WB_W: Vector3, frozen: bool, law: Adaptation) -> Vector3:
    """The force in N, world, that acts besides thrust and weight, with one more velocity measured."""
    sigma = unexplained_force(estimate, v_WB_W, law)
    old, share = estimate.found, 0.0 if frozen else law.share
    new = (
        old[0] + share * (sigma[0] - old[0]),
        old[1] + share * (sigma[1] - old[1]),
        old[2] + share * (sigma[2] - old[2]),
    )
    size = math.sqrt(dot(new, new))
    return scaled(new, law.limit_N / size if size > law.limit_N else 1.0)


def unexplained_force(estimate: Estimate, v_WB_W: Vector3, law: Adaptation) -> Vector3:
    """sigma in N, world."""
    v = estimate.velocity
    return (law.gain * (v[0] - v_WB_W[0]), law.gain * (v[1] - v_WB_W[1]), law.gain * (v[2] - v_WB_W[2]))


def predicted_velocity(estimate: Estimate, v_WB_W: Vector3, thrust_N: float, b3_W: Vector3, law: Adaptation) -> Vector3:
    """The velocity in m/s, world, expected one period later. b3_W: the direction of the thrust."""
    v, sigma = estimate.velocity, unexplained_force(estimate, v_WB_W, law)
    return (
        v[0] + law.period_s * ((b3_W[0] * thrust_N + sigma[0]) / law.mass_kg + POLE * (v[0] - v_WB_W[0])),
        v[1] + law.period_s * ((b3_W[1] * thrust_N + sigma[1]) / law.mass_kg + POLE * (v[1] - v_WB_W[1])),
        v[2]
        + law.period_s * ((b3_W[2] * thrust_N + sigma[2]) / law.mass_kg + POLE * (v[2] - v_WB_W[2]) - GRAVITY_M_PER_S2),
    )
