"""Current loop lag: the force follows its command with one pole, or two."""

import numpy as np

from hil_sim.physics.motor import current_loop_lag as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import EITHER, RegressionData, ShapeParameters, TermFamily
from reconcile.catalogue.transport_delay import answers_late, lateness

TIMES_S = (2e-4, 5e-4, 1e-3, 1.5e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6.5e-3, 8e-3)
ORDERS = (1.0, 2.0)
"""Poles: one, or two equal ones with the same sum of time constants."""


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    time_s, order = shape
    rate_n_s = np.gradient(data.model_force_n, data.period_s)
    column = rate_n_s + (0.25 * time_s * np.gradient(rate_n_s, data.period_s) if order > 1.0 else 0.0)
    lead: Array = time_s * column[:, None]
    return lead


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """One pole, as the plant has it."""
    time_s = of.params.time_s
    return [ModelTerm(of.effect, (time_s, 1.0), (1.0,))] if time_s > 0.0 else []


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(
        TermFamily(
            _columns,
            lambda _datasets: [(time, order) for time in TIMES_S for order in ORDERS],
            per_recording=EITHER,
        ),
    ),
    parameters_of=lateness,
    sentence=lambda p: answers_late(p, "a lag of the current loop"),
    continuous_shape_parameters=1,
    timing=True,
    # two poles and a delay differ only above the bandwidth of the regression
    equivalent=("transport_delay",),
    from_plant=_from_plant,
    rivals=(
        Rival("presliding_hysteresis"),
        Rival("drive_compliance"),
        Rival(
            "transport_delay",
            "a delay turns the phase in proportion to the frequency, a lag of first order ever less",
        ),
    ),
    shown_by="what is left follows the rate of the force",
    plausible=lambda _sizes: [PlausibleTerm((2e-3, 1.0), (1.0,))],
    rank=16,
)
