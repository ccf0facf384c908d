"""Step events: a quantity changes at one instant of the run and stays changed.

In no catalogue, and common: a load is set down, a brake drags, a lubricator stops, a buffer is filled up.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hil_sim.physics.load import step_in_time
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile.catalogue.kinds import (
    IN_A_RECORDING,
    OWN,
    RegressionData,
    ShapeParameters,
    SiParameter,
    UnnamedTerm,
)

SPACING_S = 0.5
"""Distance of the instants to try, s; larger where MOST_INSTANT_SECONDS bounds their number."""
MOST_INSTANT_SECONDS = 5000.0
"""Instants to try times recorded seconds: bounds the memory, so long recordings have fewer instants."""
LEAST_CHANGE_SHARE = 0.2
"""Change over the mean of a recording below which the mean is reported in place of the change; chosen."""
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
    count = min(int(longest_s * (1.0 - 2.0 * MARGIN) / SPACING_S), int(MOST_INSTANT_SECONDS / whole_s))
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
        return _before_and_after(data, shape[0], per_unit)[:, None]

    return UnnamedTerm(
        shapes=_instants,
        columns=columns,
        parameters=lambda shape, coefficients: {
            "moment_s": SiParameter(shape[0], "s"),
            "change": SiParameter(float(coefficients[0]), unit),
        },
        finding=lambda p: (
            f"{p['moment_s']:.1f} s into the run the {name} changes by {p['change']:.3g} {unit}, and stays so"
        ),
        section=section_of(step_in_time) if key else "",
        to_plant=lambda p: {"moment_s": p["moment_s"], key: sign * p["change"]},
    )


def _before_and_after(
    data: RegressionData, moment_s: float, per_unit: Callable[[RegressionData], Array]
) -> Array:
    found: Array = np.where(data.time_s > moment_s, 0.5, -0.5) * per_unit(data)
    return found


def _step_in_a_recording(name: str, unit: str, per_unit: Callable[[RegressionData], Array]) -> UnnamedTerm:
    """A step in one recording, which may have a mean of its own; no plant file can hold it."""

    def columns(data: RegressionData, shape: ShapeParameters) -> Array:
        """The step and the mean of the recording, (n, 2)."""
        return np.stack((_before_and_after(data, shape[0], per_unit), per_unit(data)), axis=1)

    def finding(p: dict[str, float]) -> str:
        if abs(p["change"]) < LEAST_CHANGE_SHARE * abs(p["mean"]):
            return f"the {name} is {p['mean']:.3g} {unit} above that of the model"
        return (
            f"the {name} changes by {p['change']:.3g} {unit} {p['moment_s']:.1f} s into the run, and stays so"
        )

    return UnnamedTerm(
        shapes=lambda datasets: _instants(datasets) if len(datasets) > 1 else [],
        columns=columns,
        parameters=lambda shape, coefficients: {
            "moment_s": SiParameter(shape[0], "s"),
            "change": SiParameter(float(coefficients[0]), unit),
            "mean": SiParameter(float(coefficients[1]), unit),
        },
        finding=finding,
        per_recording=OWN,
    )


QUANTITIES: dict[str, tuple[str, str, Callable[[RegressionData], Array]]] = {
    "force": ("constant force", "N", lambda data: np.ones(len(data.time_s))),
    "friction": ("friction", "N", lambda data: data.motion.direction),
    "viscous_friction": ("viscous friction", "N s/m", lambda data: data.motion.velocity_m_s),
    "mass": ("mass", "kg", lambda data: data.motion.acceleration_m_s2),
    "delay": ("delay of the force", "s", lambda data: np.gradient(data.model_force_n, data.period_s)),
}
"""What may change at a moment: its name, its unit, and the force that one unit of it makes."""
MOMENTS = {
    **{key: _step(*of, key) for key, of in QUANTITIES.items()},
    **{f"{key}{IN_A_RECORDING}": _step_in_a_recording(*of) for key, of in QUANTITIES.items()},
}
"""By the quantity that changes."""
_SLIP = ("place of the scale against the motor", "m", lambda data: np.ones(len(data.time_s)))
SLIPS = {"slip": _step(*_SLIP), f"slip{IN_A_RECORDING}": _step_in_a_recording(*_SLIP)}
"""The step events of the position deviation."""
