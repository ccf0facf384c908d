"""Step events: a quantity changes at one instant of the run and stays changed.

In no catalogue, and common: a load is set down, a brake drags, a lubricator stops, a buffer is filled up.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hil_sim.physics.load import step_in_time
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile.catalogue.kinds import Parameter, RegressionData, ShapeParameters, UnnamedTerm

EVERY_S = 0.5
"""Distance of the instants to try, s; more where MOST_INSTANT_SECONDS bounds their number."""
MOST_INSTANT_SECONDS = 5000.0
"""Instants to try times recorded seconds: bounds the memory, so long recordings have fewer instants."""
MARGIN = 0.05
"""Share of the run at either end without instants: too few samples lie beyond them."""


IN_A_PLANT = {
    "force": ("force_n", -1.0),
    "friction": ("level_n", 1.0),
    "viscous_friction": ("damping_n_s_m", 1.0),
    "mass": ("mass_kg", 1.0),
}
"""By the quantity that changes: the plant's parameter and its sign; a force on the table is the opposite."""


def _instants(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    longest_s = max(float(data.time_s[-1]) for data in datasets)
    whole_s = sum(float(data.time_s[-1]) for data in datasets)
    count = min(int(longest_s * (1.0 - 2.0 * MARGIN) / EVERY_S), int(MOST_INSTANT_SECONDS / whole_s))
    return [(float(t),) for t in np.linspace(MARGIN, 1.0 - MARGIN, max(count, 2)) * longest_s]


def _step(
    name: str, unit: str, per_unit: Callable[[RegressionData], Array], quantity: str = ""
) -> UnnamedTerm:
    """A step of the quantity `name`; `per_unit`: force or deviation (n,) that one unit of it makes.

    `quantity`: its key in IN_A_PLANT, empty where a plant has no such step.
    """
    key, sign = IN_A_PLANT.get(quantity, ("", 0.0))

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
        section=section_of(step_in_time) if key else "",
        to_plant=lambda p: {"moment_s": p["moment_s"], key: sign * p["change"]},
    )


MOMENTS = {
    "force": _step("constant force", "N", lambda data: np.ones(len(data.time_s)), "force"),
    "friction": _step("friction", "N", lambda data: data.motion.direction, "friction"),
    "viscous_friction": _step(
        "viscous friction", "N s/m", lambda data: data.motion.velocity_m_s, "viscous_friction"
    ),
    "mass": _step("mass", "kg", lambda data: data.motion.acceleration_m_s2, "mass"),
    "delay": _step("delay of the force", "s", lambda data: np.gradient(data.model_force_n, data.period_s)),
}
"""By the quantity that changes."""
SLIP = _step("place of the scale against the motor", "m", lambda data: np.ones(len(data.time_s)))
"""The step event of the position deviation."""
