"""Gravity on a rotary axis, a sin(q) + b cos(q); on a linear axis it is a constant force.

The coordinate of a rotary axis is its angle: 1 m stands for 1 rad.
"""

import math
from collections.abc import Sequence

import numpy as np

from hil_sim.physics.load import gravity as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter, TermFamily
from reconcile.catalogue.periodic import amplitude_and_phase_rad, pair, sine_and_cosine

LEAST_RANGE_RAD = 0.5
"""Range of angles below which a weight is a constant and a slope; chosen."""


def range_rad(datasets: Sequence[RegressionData]) -> float:
    """Largest range of angles in a recording; 0 on a linear axis."""
    ranges = [float(np.ptp(data.motion.position_m)) for data in datasets if data.rotary]
    return max(ranges) if len(ranges) == len(datasets) else 0.0


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Angle by coordinate, rad/m."""
    return [(1.0,)] if range_rad(datasets) >= LEAST_RANGE_RAD else []


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    return pair(shape[0] * data.motion.position_m)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """The force on the table is the opposite of what the motor needs."""
    amplitude_n, phase_rad = amplitude_and_phase_rad(*(-coefficients[:2]).tolist())
    return {
        "amplitude_n": SiParameter(amplitude_n, "N"),
        "phase_rad": SiParameter(phase_rad, "rad"),
        "angle_rad_m": SiParameter(shape[0], "rad/m"),
    }


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    p = of.params
    coefficients = sine_and_cosine(-p.amplitude_n, p.phase_rad)
    return [ModelTerm(of.effect, (p.angle_rad_m,), coefficients)] if p.amplitude_n != 0.0 else []


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"a moment of {p['amplitude_n']:.3g} follows the sine of the axis' angle, zero at "
        f"{math.degrees(-p['phase_rad'] / p['angle_rad_m']):.0f} degrees: a weight that hangs on the axis; a "
        "spring would not come back after a turn"
    ),
    from_plant=_from_plant,
    rivals=(
        Rival("position_dependent_force", "over half a turn and more a weight turns over, a spring does not"),
        Rival("constant_force", "a weight changes with the angle, a constant force does not"),
    ),
    shown_by="the force follows the sine of the angle, at any speed",
    rank=6,
)
