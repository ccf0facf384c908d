"""Step events: a quantity changes at one instant of the run and stays changed.

In no catalogue, and common: a load is set down, a brake drags, a lubricator stops, a buffer is filled up.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import Parameter, RegressionData, ShapeParameters

EVERY_S = 0.5
"""Distance of the instants to try, s; more where MOST_INSTANT_SECONDS bounds their number."""
MOST_INSTANT_SECONDS = 5000.0
"""Instants to try times recorded seconds: bounds the memory, so long recordings have fewer instants."""
MARGIN = 0.05
"""Share of the run at either end without instants: too few samples lie beyond them."""


class Moment(NamedTuple):
    """The quantity that changes."""

    name: str
    """Its name in a sentence."""
    unit: str
    column: Callable[[RegressionData], Array]
    """(n,) per unit."""

    def shapes(self, datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
        """Instants to try, s."""
        longest_s = max(float(data.time_s[-1]) for data in datasets)
        whole_s = sum(float(data.time_s[-1]) for data in datasets)
        count = min(int(longest_s * (1.0 - 2.0 * MARGIN) / EVERY_S), int(MOST_INSTANT_SECONDS / whole_s))
        return [(float(t),) for t in np.linspace(MARGIN, 1.0 - MARGIN, max(count, 2)) * longest_s]

    def columns(self, data: RegressionData, shape: ShapeParameters) -> Array:
        """-1/2 before and +1/2 after the instant, (n, 1): the model has the mean."""
        step = np.where(data.time_s > shape[0], 0.5, -0.5)
        return (step * self.column(data))[:, None]

    def parameters(self, shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
        """Instant and change."""
        return {"moment_s": Parameter(shape[0], "s"), "change": Parameter(float(coefficients[0]), self.unit)}

    def sentence(self, p: dict[str, float]) -> str:
        """Explanation after `EXPLAINED_BY_NOTHING`."""
        return (
            f"{p['moment_s']:.1f} s into the run the {self.name} changes by {p['change']:.3g} {self.unit}, "
            "and stays so"
        )


MOMENTS = {
    "force": Moment("constant force", "N", lambda data: np.ones(len(data.time_s))),
    "friction": Moment("friction", "N", lambda data: data.motion.direction),
    "viscous_friction": Moment("viscous friction", "N s/m", lambda data: data.motion.velocity_m_s),
    "mass": Moment("mass", "kg", lambda data: data.motion.acceleration_m_s2),
    "delay": Moment("delay of the force", "s", lambda data: np.gradient(data.model_force_n, data.period_s)),
}
"""By the quantity that changes."""
SLIP = Moment("place of the scale against the motor", "m", lambda data: np.ones(len(data.time_s)))
"""The step event of the position deviation."""
