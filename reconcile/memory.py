"""A linear memory of the motion: what rings after it, or dies away, and stands in no catalogue.

Ringing is a mass that hangs on the axis by a spring (a tank, a cable, a machine bed): excited by the table's
acceleration, it pulls with its own frequency. Dying away is a spring in series with a damper (a hose, a
cover, an elastomer), Maxwell's element: excited by the velocity.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import lfilter

from reconcile.catalogue.kinds import Parameter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

DAMPING = 0.06
"""Of the resonators: each hears what lies within a tenth of its frequency."""
FREQUENCIES_HZ = tuple(float(f) for f in np.geomspace(4.0, 50.0, 20))
TIMES_S = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)


class Ringing:
    """A resonator, behind the acceleration."""

    def shapes(self, _scenes: Sequence[Scene]) -> list[Shape]:
        """Frequencies, Hz."""
        return [(f,) for f in FREQUENCIES_HZ]

    def columns(self, scene: Scene, shape: Shape) -> Array:
        """In phase and a quarter later, each per kg, (n, 2); exact for straight lines between samples."""
        w = 2.0 * math.pi * shape[0]
        pole = np.exp(scene.period_s * complex(-DAMPING * w, w * math.sqrt(1.0 - DAMPING**2)))
        # a complex pole of unit gain at rest: its real and imaginary parts span the resonator's answers
        answer = lfilter([1.0 - pole], [1.0, -pole], scene.motion.acceleration_m_s2.astype(complex))
        return np.stack((answer.real, answer.imag), axis=1)

    def parameters(self, shape: Shape, coefficients: Array) -> dict[str, Parameter]:
        """Frequency, and the mass that answers."""
        return {
            "frequency_hz": Parameter(shape[0], "Hz"),
            "mass_kg": Parameter(float(np.hypot(*coefficients)), "kg"),
        }

    def sentence(self, p: dict[str, float]) -> str:
        """Where to look."""
        return (
            "something real that no entry of the catalogue explains: after an acceleration the axis is "
            f"pulled to and fro at {p['frequency_hz']:.1f} Hz, as by {p['mass_kg']:.2g} kg on a spring"
        )


class Relaxing:
    """A first-order lag, behind the velocity."""

    def shapes(self, _scenes: Sequence[Scene]) -> list[Shape]:
        """Time constants, s."""
        return [(t,) for t in TIMES_S]

    def columns(self, scene: Scene, shape: Shape) -> Array:
        """What is left of the velocity, (n, 1)."""
        pole = math.exp(-scene.period_s / shape[0])
        return lfilter([1.0 - pole], [1.0, -pole], scene.motion.velocity_m_s)[:, None]

    def parameters(self, shape: Shape, coefficients: Array) -> dict[str, Parameter]:
        """Time constant, and the viscous friction that comes late."""
        return {
            "time_s": Parameter(shape[0], "s"),
            "late_viscous_n_s_m": Parameter(float(coefficients[0]), "N s/m"),
        }

    def sentence(self, p: dict[str, float]) -> str:
        """Where to look."""
        return (
            "something real that no entry of the catalogue explains: part of the force follows the speed "
            f"{p['time_s']:.2g} s late, {p['late_viscous_n_s_m']:.3g} N s/m of it: it relaxes"
        )
