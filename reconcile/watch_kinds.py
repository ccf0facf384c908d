"""What the watch measures of an axis: indicators by their column of the engine, at one fixed shape each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from reconcile.catalogue.kinds import Sense

if TYPE_CHECKING:
    from reconcile.catalogue.kinds import Shape

LOW_SPEED_M_S = 5e-3
"""Of the bump of friction towards standstill."""
SHORT_PLAY_M = 1e-6
"""Half of it: lost motion is what is lost by the end of a stroke, of play and of wind-up alike."""


class Kind(NamedTuple):
    """One indicator: what it measures, and by which column."""

    name: str
    unit: str
    words: str
    effect: str
    """Of the catalogue; empty for a coefficient of the rigid model."""
    shape: Shape
    factor: float
    """The indicator is so many times the coefficient."""
    beside: bool
    """Fitted beside the others; else on top of them, so that it widens nobody's error."""


KINDS = {
    Sense.FORCE: (
        Kind("mass_kg", "kg", "moved mass", "", (), 1.0, beside=True),
        Kind("viscous_n_s_m", "N s/m", "viscous friction", "", (), 1.0, beside=True),
        Kind("coulomb_n", "N", "Coulomb friction", "", (), 1.0, beside=True),
        Kind("constant_n", "N", "constant force", "constant_force", (), 1.0, beside=True),
        Kind(
            "low_speed_n",
            "N",
            "friction below 5 mm/s more",
            "stribeck_friction",
            (LOW_SPEED_M_S,),
            1.0,
            beside=False,
        ),
        Kind("once_a_turn_n", "N", "force once a turn of the screw", "cogging", (1.0,), 1.0, beside=False),
    ),
    Sense.DEVIATION: (
        Kind(
            "lost_motion_m",
            "m",
            "lost motion at a reversal",
            "backlash",
            (SHORT_PLAY_M, math.inf, 0.0),
            2.0,
            beside=True,
        ),
        Kind("lead_error", "", "lead error", "lead_error_cumulative", (), 1.0, beside=True),
        Kind("compliance_m_n", "m/N", "compliance of the drive", "drive_compliance", (), 1.0, beside=False),
        Kind(
            "once_a_turn_m",
            "m",
            "deviation once a turn of the screw",
            "lead_error_periodic",
            (1.0,),
            1.0,
            beside=False,
        ),
    ),
}
LEVEL = "residual"
"""The indicator of what is left, as the natural logarithm of its RMS in N or m."""
LEVEL_WORDS = {Sense.FORCE: "force that nothing explains", Sense.DEVIATION: "deviation that nothing explains"}
