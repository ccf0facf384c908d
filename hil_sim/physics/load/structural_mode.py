"""Structural mode: a mass carried elastically on the table, which rings after every step of acceleration.

Law: mc xc'' = -F, and +F on the table, with F = mc (w^2 d + 2 zeta w d'), d = xc - x, w = 2 pi f.
Source: the oscillator of one degree of freedom on a moving base; a step of its acceleration by a leaves an
    amplitude of a / w^2 that decays with zeta w. Its excitation by trapezoidal motion is what Wang et al.
    2014, section 3, smooth; residual vibration of moved structures: Singer and Seering (1990).
Symbols: mc `mass_kg` kg, besides the table's; f `frequency_hz` Hz, with the table held; zeta
    `damping_ratio`; xc position of the carried mass m; x table position m; d deflection m; F force N.
Valid: one mode in the direction of motion, small deflections: a slide, a fixture, the bracket of a reading
    head. Scale and external measurements read xc; without the section they read the table.
Confused with: drive_compliance, similar ringing -> there the motor encoder oscillates against the scale and
    the frequency depends on the amplifier's gains, here the frequency is fixed and the motor is at rest; a
    velocity loop near instability -> also rings at standstill.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.COUPLING


class Params(NamedTuple):
    """The carried mass, its frequency and damping."""

    mass_kg: Annotated[float, Quantity("kg", 1e-7, 1e4, "carried mass mc, besides the table's")]
    frequency_hz: Annotated[float, Quantity("Hz", 0.1, 2e3, "natural frequency f, table held")]
    damping_ratio: Annotated[float, Quantity("", 0.0, 1.0, "damping ratio zeta")]


NEUTRAL = None
"""No values make its spring rigid: without the section no mass is carried."""


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem unless k dt^2 + 2 c dt < m.

    Semi-implicit Euler is stable up to 4 m; a quarter keeps the frequency error small.
    """
    w_dt = 2.0 * math.pi * p.frequency_hz * axis.dt_s
    if (w_dt**2 + 4.0 * p.damping_ratio * w_dt) * (1.0 + p.mass_kg / axis.moved_kg) > 1.0:
        yield "", "too stiff for the table at this substep: lower frequency_hz or mass_kg"


@kernel
def force_n(p: Any, deflection_m: float, rate_m_s: float) -> float:
    """Return the force on the table (N) of a mass `deflection_m` ahead that moves away at `rate_m_s`."""
    w = 2.0 * math.pi * p.frequency_hz
    return float(p.mass_kg * (w * w * deflection_m + 2.0 * p.damping_ratio * w * rate_m_s))
