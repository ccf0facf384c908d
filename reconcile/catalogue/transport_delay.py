"""Transport delay: the force acts, or the position arrives, later than recorded."""

import numpy as np

from hil_sim.physics.motor import transport_delay as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, Rival
from reconcile.catalogue.kinds import EITHER, RegressionData, ShapeParameters, SiParameter, TermFamily

TIMES_S = (2e-4, 4e-4, 6e-4, 8e-4, 1e-3, 1.3e-3, 1.7e-3, 2.2e-3, 3e-3, 4e-3, 6e-3, 8e-3)


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    early_n = np.interp(data.time_s + shape[0], data.time_s, data.model_force_n)
    return (early_n - data.model_force_n)[:, None]


def lateness(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """Delay or lag, s: to first order the coefficient times the time of the shape."""
    return {"time_s": SiParameter(shape[0] * float(coefficients[0]), "s")}


def answers_late(p: dict[str, float], why: str) -> str:
    """Sentence of an effect that delays the force."""
    return (
        f"the axis answers {p['time_s'] * 1e3:.2f} ms after the recorded force, in proportion to the force's "
        f"rate of change: {why}"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    delay_s = of.params.delay_s
    return [ModelTerm(of.effect, (delay_s,), (1.0,))] if delay_s > 0.0 else []


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, lambda _datasets: [(time,) for time in TIMES_S], per_recording=EITHER),),
    parameters_of=lateness,
    sentence=lambda p: answers_late(p, "a delay between the channels"),
    continuous_shape_parameters=1,
    timing=True,
    # two poles and a delay differ only above the bandwidth of the regression
    equivalent=("current_loop_lag",),
    to_plant=lambda found, _notes: {"delay_s": found.terms[0]["time_s"]},
    from_plant=_from_plant,
    rivals=(Rival("presliding_hysteresis"), Rival("drive_compliance"), Rival("current_loop_lag")),
    shown_by="what is left follows the jerk",
)
