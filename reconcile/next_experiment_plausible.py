"""What may be there although nobody has seen it: each effect in a size that machines have.

Sizes are shares of what the axis itself has (its Coulomb friction, its peak force, its travel), or the middle
of the range that the catalogue gives. They say what is worth looking for, not what is there.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from reconcile.catalogue.kinds import Sense
from reconcile.expected_evidence import Sized

if TYPE_CHECKING:
    from reconcile.catalogue.kinds import Shape
    from reconcile.next_experiment_recorded import Recorded

LARGE, SMALL = 0.2, 0.1
"""Of the Coulomb friction: what a friction or a ripple may well be."""
TURNS = 4.0
"""A turn: ripple of cogging and torque."""
HERTZ = 7.3
"""Of a disturbance that nobody asked for, no multiple of a motion's frequency."""


def plausible(seen: Recorded, sense: Sense) -> list[Sized]:
    """By sense; N and m, coefficients of the catalogue's columns."""
    if sense is Sense.DEVIATION:
        return _between_motor_and_scale()
    coulomb_n = max(seen.coulomb_n, 1e-3)
    large_n, small_n = LARGE * coulomb_n, SMALL * coulomb_n
    fastest_m_s = max(seen.fastest_m_s, 1e-6)
    peak_n = seen.mass_kg * seen.hardest_m_s2 + coulomb_n + seen.viscous_n_s_m * fastest_m_s
    middle_m, half_m = 0.5 * (seen.lowest_m + seen.highest_m), 0.5 * (seen.highest_m - seen.lowest_m)
    places = (2.0, middle_m, max(half_m, 1e-6))
    sizes: list[tuple[str, Shape, tuple[float, ...]]] = [
        ("stribeck_friction", (4e-3,), (large_n,)),
        ("stribeck_friction", (2e-2,), (large_n,)),
        ("presliding_hysteresis", (2e-5, 1.0), (0.5 * coulomb_n,)),
        ("dwell_dependent_breakaway", (1e-5, 1.0), (large_n,)),
        ("asymmetric_viscous_friction", (), (large_n / fastest_m_s,)),
        ("quadratic_viscous_friction", (), (large_n / fastest_m_s**2,)),
        ("constant_force", (), (large_n,)),
        ("position_dependent_friction", places, (small_n, small_n)),
        ("position_dependent_force", places, (small_n, small_n)),
        ("cogging", (TURNS,), (small_n, 0.0)),
        ("torque_ripple", (TURNS,), (0.03, 0.0)),
        ("periodic_disturbance", (HERTZ,), (small_n, 0.0)),
        ("torque_constant_saturation", (peak_n,), (0.05,)),
        ("voltage_saturation", (1.05 * peak_n, 1.6 * fastest_m_s), (1.0,)),
        ("amplifier_dead_zone", (0.25 * coulomb_n,), (small_n,)),
        ("current_loop_lag", (2e-3, 1.0), (1.0,)),
    ]
    return [Sized((effect, shape), coefficients) for effect, shape, coefficients in sizes]


def _between_motor_and_scale() -> list[Sized]:
    return [
        Sized(("backlash", (2e-6, math.inf, 0.0)), (2e-6,)),
        Sized(("drive_compliance", ()), (1e-8,)),
        Sized(("lead_error_cumulative", ()), (2e-5,)),
        Sized(("lead_error_periodic", (1.0,)), (1e-6, 0.0)),
        Sized(("scale_cyclic_error", (2e-5,)), (1e-7, 0.0)),
    ]
