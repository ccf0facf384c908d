"""Cross-coupled contour control: what two axes are beside the commanded path becomes a velocity of both.

    n = (-v_y, v_x) / |v|,   k = (v_x a_y - v_y a_x) / |v|^3       left normal and curvature of the command
    c = n + k e,   eps = (2 n e + k |e|^2) / (1 + |c|)             contour error, path left of the table
    w = kp eps + I,   dI/dt = ki eps,   |I|, |w| <= limit
    offset = w min(1, |v| / v_full) c / |c|                        velocity added to both set points

e = command - table, of both axes. Source: Koren and Lo 1991, Variable-gain cross-coupling controller for
contouring, CIRP Annals 40 (1), 371-374: c has their variable gains C_x, C_y, which follow the direction and
the radius of the command; on a line eps = -e_x sin + e_y cos. Unlike their series to the second order, eps is
the whole distance to the circle that osculates the command, and radius and direction come from the set points
themselves, so that lines, circles and any other path are one law.

At standstill the command has no direction: the offset fades out below v_full, and the integral begins anew.
Valid for |k e| << 1; the curvature used is at most that of |k e| = 1/4.
"""

import math
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control.limits import clamp

NEAR = 0.25
"""Largest |k e|: where the path turns within four errors, its centre says nothing about the error; chosen."""


class Pair(NamedTuple):
    """A value of each of the two axes, m, m/s or m/s^2."""

    first: float
    second: float


class Params(NamedTuple):
    """Gains of the coupling of two axes."""

    kp_1_s: Annotated[float, Quantity("1/s", 0.0, math.inf, "velocity per contour error")]
    ki_1_s2: Annotated[float, Quantity("1/s2", 0.0, math.inf, "integral gain")]
    limit_m_s: Annotated[float, Quantity("m/s", 0.0, math.inf, "of the velocity and of its integral, > 0")]
    full_speed_m_s: Annotated[float, Quantity("m/s", 0.0, math.inf, "commanded speed of full effect, > 0")]
    period_s: float


class State(NamedTuple):
    """What one cycle passes to the next."""

    integral_m_s: float
    offset_m_s: Pair
    """Velocity added to the set points of both axes."""


@kernel
def at_rest() -> State:
    """State without a direction: no offset, an empty integral."""
    return State(integral_m_s=0.0, offset_m_s=Pair(0.0, 0.0))


@kernel
def coupled(
    p: Params, state: State, error_m: Pair, velocity_m_s: Pair, acceleration_m_s2: Pair
) -> tuple[State, float]:
    """Return the next state, which has the velocity offsets, and the contour error, m.

    `error_m`: command - table; velocity and acceleration are those of the command. Where a value is not
    finite, the state stays, as set points do, and the error is NaN. At standstill the state begins anew.
    """
    speed_m_s = math.hypot(velocity_m_s.first, velocity_m_s.second)
    distance_m = math.hypot(error_m.first, error_m.second)
    turning_m2_s3 = (
        velocity_m_s.first * acceleration_m_s2.second - velocity_m_s.second * acceleration_m_s2.first
    )
    if not math.isfinite(speed_m_s + distance_m + turning_m2_s3):
        return state, math.nan
    if speed_m_s == 0.0:
        return at_rest(), 0.0
    normal = Pair(-velocity_m_s.second / speed_m_s, velocity_m_s.first / speed_m_s)
    curvature_1_m = 0.0
    if distance_m > 0.0:
        curvature_1_m = clamp(turning_m2_s3 / speed_m_s**3, NEAR / distance_m)
    first = normal.first + curvature_1_m * error_m.first
    second = normal.second + curvature_1_m * error_m.second
    length = math.hypot(first, second)
    beside_m = normal.first * error_m.first + normal.second * error_m.second
    contour_m = (2.0 * beside_m + curvature_1_m * distance_m**2) / (1.0 + length)

    stepped_m_s = clamp(state.integral_m_s + p.ki_1_s2 * p.period_s * contour_m, p.limit_m_s)
    wanted_m_s = p.kp_1_s * contour_m + stepped_m_s
    if abs(wanted_m_s) > p.limit_m_s and wanted_m_s * contour_m > 0.0:
        stepped_m_s = state.integral_m_s  # at the limit, and the step would push further out
        wanted_m_s = p.kp_1_s * contour_m + stepped_m_s
    offset_m_s = clamp(wanted_m_s, p.limit_m_s) * min(1.0, speed_m_s / p.full_speed_m_s) / length
    return State(stepped_m_s, Pair(offset_m_s * first, offset_m_s * second)), contour_m
