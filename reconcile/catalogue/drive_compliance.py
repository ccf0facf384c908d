"""Compliance of the drive: scale less motor in proportion to the transmitted force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


def _one(_scenes: Sequence[Scene]) -> list[Shape]:
    return [()]


def _columns(scene: Scene, _shape: Shape) -> Array:
    # what the motor's own inertia takes is not transmitted; a column of its own where that is not known
    acceleration = scene.motion.acceleration_m_s2
    if scene.motor_mass_kg > 0.0:
        return (scene.motor_mass_kg * acceleration - scene.force_n)[:, None]
    return np.stack((-scene.force_n, acceleration), axis=1)


HYPOTHESES = [Hypothesis(Sense.DEVIATION, _one, _columns)]
EQUIVALENT = ()
SYSTEMATIC = {"compliance_m_n": (0.0, 1.5), "stiffness_n_m": (0.6, 0.0)}
"""Friction in front of the spring (nut, bearings) is not transmitted; 60 % of it may be there, unseen."""


def possible(coefficients: Array) -> bool:
    """No spring is negative."""
    return bool(coefficients[0] > 0.0)


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Stiffness."""
    compliance_m_n = float(coefficients[0])
    return {
        "compliance_m_n": Parameter(compliance_m_n, "m/N"),
        "stiffness_n_m": Parameter(1.0 / compliance_m_n, "N/m"),
    }


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    least = (1.0 - SYSTEMATIC["stiffness_n_m"][0]) * p["stiffness_n_m"]
    return (
        f"the scale lags the motor by {p['compliance_m_n'] * 1e6:.4f} um per newton of force (stiffness "
        f"{p['stiffness_n_m'] * 1e-6:.0f} N/um, or down to {least * 1e-6:.0f} where friction acts in front "
        "of the spring): compliance of the drive; backlash would step whatever the force"
    )
