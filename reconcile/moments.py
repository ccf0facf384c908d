"""A change at one moment of the run: something that is so before it, and otherwise after it.

In no catalogue, and common: a load is set down, a brake drags, a lubricator stops, a buffer is filled up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Parameter

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

EVERY_S = 0.5
MOST_S = 5000.0
"""Moments that are tried, times all that was recorded: what memory holds. Long data have fewer."""
MARGIN = 0.05
"""Of the run, at either end: too little is left there to see a change by."""


class Moment(NamedTuple):
    """What changes."""

    name: str
    """In a sentence."""
    unit: str
    column: Callable[[Scene], Array]
    """(n,) per unit."""

    def shapes(self, scenes: Sequence[Scene]) -> list[Shape]:
        """The moments, s."""
        longest_s = max(float(scene.time_s[-1]) for scene in scenes)
        whole_s = sum(float(scene.time_s[-1]) for scene in scenes)
        count = min(int(longest_s * (1.0 - 2.0 * MARGIN) / EVERY_S), int(MOST_S / whole_s))
        return [(float(t),) for t in np.linspace(MARGIN, 1.0 - MARGIN, max(count, 2)) * longest_s]

    def columns(self, scene: Scene, shape: Shape) -> Array:
        """Before it -1/2, after it +1/2: the mean is the model's own, (n, 1)."""
        step = np.where(scene.time_s > shape[0], 0.5, -0.5)
        return (step * self.column(scene))[:, None]

    def parameters(self, shape: Shape, coefficients: Array) -> dict[str, Parameter]:
        """When, and by how much."""
        return {
            "moment_s": Parameter(shape[0], "s"),
            "change": Parameter(float(coefficients[0]), self.unit),
        }

    def sentence(self, p: dict[str, float]) -> str:
        """Where to look."""
        return (
            f"something real that no entry of the catalogue explains: {p['moment_s']:.1f} s into the run the "
            f"{self.name} changes by {p['change']:.3g} {self.unit}, and stays so"
        )


def _rate_n_s(scene: Scene) -> Array:
    return np.gradient(scene.model_force_n, scene.period_s)


MOMENTS = {
    "force": Moment("constant force", "N", lambda s: np.ones(len(s.time_s))),
    "friction": Moment("friction", "N", lambda s: s.motion.direction),
    "viscous_friction": Moment("viscous friction", "N s/m", lambda s: s.motion.velocity_m_s),
    "mass": Moment("mass", "kg", lambda s: s.motion.acceleration_m_s2),
    "delay": Moment("delay of the force", "s", _rate_n_s),
}
"""By what changes."""
SLIP = Moment("place of the scale against the motor", "m", lambda s: np.ones(len(s.time_s)))
"""Of the deviation."""
