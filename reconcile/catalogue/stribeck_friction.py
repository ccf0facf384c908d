"""Stribeck friction: (Fs - Fc) exp(-(v / vs)^2) in the direction of motion.

Fs - Fc is negative where friction falls towards standstill.
"""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.friction import stribeck_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily, continued

LEAST_SLOW_S = 0.3
"""Least time that the axis moved no faster than about a Stribeck speed, for that speed to be tried."""
PASSING_S = 5e-3
"""Time within which an axis merely accelerates past a speed, which the filters see as a reversal; chosen."""
LOW_SPEED_M_S = 5e-3
"""Stribeck speed of the indicator."""
SPEEDS_M_S = (0.0005, 0.001, 0.002, 0.0035, 0.006, 0.01, 0.014, 0.02, 0.03, 0.05)
FASTEST_SHARE = 0.2
"""Highest Stribeck speed on a rotary axis, over its highest speed. Chosen; the list above is for tables."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    fastest = max(float(np.abs(data.motion.velocity_m_s).max()) for data in datasets)
    speeds = continued(SPEEDS_M_S, FASTEST_SHARE * fastest if datasets[0].rotary else 0.0)
    return [(v,) for v in speeds if _slow_s(datasets, v) > LEAST_SLOW_S]


def _slow_s(datasets: Sequence[RegressionData], speed_m_s: float) -> float:
    """Time (s) in which the axis moved below 1.5 times a speed, without only passing it."""
    slow_s = 0.0
    for data in datasets:
        m = data.motion
        slow = m.moving & (np.abs(m.velocity_m_s) < 1.5 * speed_m_s)
        steady = np.abs(m.acceleration_m_s2) * PASSING_S < speed_m_s
        slow_s += data.period_s * float(np.count_nonzero(slow & steady))
    return slow_s


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    m = data.motion
    return (m.direction * np.exp(-((m.velocity_m_s / shape[0]) ** 2)))[:, None]


def _sentence(p: dict[str, float]) -> str:
    change = "rises" if p["stribeck_n"] > 0.0 else "falls"
    return (
        f"friction {change} by {abs(p['stribeck_n']):.2f} N below {p['stribeck_m_s'] * 1e3:.1f} mm/s, in "
        "both directions alike and at constant speed too: Stribeck friction; presliding would show over the "
        "way, not the speed"
    )


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    coefficients={"stribeck_n": "N"},
    shape_parameters={"stribeck_m_s": "m/s"},
    sentence=_sentence,
    continuous_shape_parameters=1,
    presliding_can_imitate=True,
    shows_after_presliding=True,
    indicators=(IndicatorKind("low_speed_n", "N", "friction below 5 mm/s more", (LOW_SPEED_M_S,)),),
    rivals=(
        Rival(
            "presliding_hysteresis",
            "a Stribeck rise stays at constant speed; presliding is over after its way",
        ),
        Rival(
            "quadratic_viscous_friction",
            "a Stribeck rise is gone at a few times its speed, a square goes on growing",
        ),
        Rival("dwell_dependent_breakaway", "only a breakaway that ages grows with the rest before it"),
    ),
    shown_by="friction rises towards standstill at constant speeds too",
    plausible=lambda sizes: [PlausibleTerm((v,), (sizes.large_n,)) for v in (4e-3, 2e-2)],
    curve_near="speed_by_direction",
    rank=1,
)
