"""Step events: a quantity changes at one instant of the run and stays changed.

In no catalogue, and common: a load is set down, a brake drags, a lubricator stops, a buffer is filled up.
"""

from collections.abc import Callable, Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import Parameter, RegressionData, ShapeParameters, UnnamedTerm

EVERY_S = 0.5
"""Distance of the instants to try, s; more where MOST_INSTANT_SECONDS bounds their number."""
MOST_INSTANT_SECONDS = 5000.0
"""Instants to try times recorded seconds: bounds the memory, so long recordings have fewer instants."""
MARGIN = 0.05
"""Share of the run at either end without instants: too few samples lie beyond them."""


def _instants(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    longest_s = max(float(data.time_s[-1]) for data in datasets)
    whole_s = sum(float(data.time_s[-1]) for data in datasets)
    count = min(int(longest_s * (1.0 - 2.0 * MARGIN) / EVERY_S), int(MOST_INSTANT_SECONDS / whole_s))
    return [(float(t),) for t in np.linspace(MARGIN, 1.0 - MARGIN, max(count, 2)) * longest_s]


def _step(name: str, unit: str, per_unit: Callable[[RegressionData], Array]) -> UnnamedTerm:
    """A step of the quantity `name`; `per_unit`: force or deviation (n,) that one unit of it makes."""

    def columns(data: RegressionData, shape: ShapeParameters) -> Array:
        """-1/2 before and +1/2 after the instant, (n, 1): the model has the mean."""
        step = np.where(data.time_s > shape[0], 0.5, -0.5)
        return (step * per_unit(data))[:, None]

    return UnnamedTerm(
        shapes=_instants,
        columns=columns,
        parameters=lambda shape, coefficients: {
            "moment_s": Parameter(shape[0], "s"),
            "change": Parameter(float(coefficients[0]), unit),
        },
        finding=lambda p: (
            f"{p['moment_s']:.1f} s into the run the {name} changes by {p['change']:.3g} {unit}, and stays so"
        ),
    )


MOMENTS = {
    "force": _step("constant force", "N", lambda data: np.ones(len(data.time_s))),
    "friction": _step("friction", "N", lambda data: data.motion.direction),
    "viscous_friction": _step("viscous friction", "N s/m", lambda data: data.motion.velocity_m_s),
    "mass": _step("mass", "kg", lambda data: data.motion.acceleration_m_s2),
    "delay": _step("delay of the force", "s", lambda data: np.gradient(data.model_force_n, data.period_s)),
}
"""By the quantity that changes."""
SLIP = _step("place of the scale against the motor", "m", lambda data: np.ones(len(data.time_s)))
"""The step event of the position deviation."""
