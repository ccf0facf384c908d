"""Amplifier dead zone: the amplifier makes no force below a threshold of the command."""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.motor import amplifier_dead_zone as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily

WIDTH_SHARES = (0.125, 0.25, 0.5, 1.0)
"""Widths of the transition to scan, as shares of the median force."""
BY_ZERO_FORCE = "a dead zone shows where the force is zero, friction where the speed is"


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    typical_n = float(np.median(np.abs(np.concatenate([data.model_force_n for data in datasets]))))
    return [(share * typical_n,) for share in WIDTH_SHARES if typical_n > 0.0]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    """1 where all of the threshold is lost, over the width of the transition."""
    return np.clip(data.model_force_n / shape[0], -1.0, 1.0)[:, None]


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """The narrowest width that is scanned: the plant's dead zone steps and has no width."""
    lost_n = of.params.threshold_a * of.axis.force_constant_n_a
    return [ModelTerm(of.effect, min(_shapes(of.datasets), default=(lost_n,)), (lost_n,))]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    coefficients={"threshold_n": "N"},
    shape_parameters={"width_n": "N"},
    sentence=lambda p: (
        f"about {p['threshold_n']:.2f} N of the commanded force are lost whenever its sign is clear, "
        "changing over at zero force and not at zero speed: a dead zone of the amplifier"
    ),
    physical=POSITIVE,  # it loses force
    continuous_shape_parameters=1,
    presliding_can_imitate=True,
    shows_after_presliding=True,
    to_plant=lambda found, _notes: {
        "threshold_a": found.terms[0]["threshold_n"] / found.axis.force_constant_n_a
    },
    from_plant=_from_plant,
    rivals=(
        Rival("asymmetric_coulomb_friction", BY_ZERO_FORCE),
        Rival("stribeck_friction", BY_ZERO_FORCE),
        Rival(
            "presliding_hysteresis",
            "a dead zone shows where the force is zero, presliding where the motion turns",
        ),
    ),
    shown_by="it shows where the force is zero",
    plausible=lambda sizes: [PlausibleTerm((0.25 * sizes.coulomb_n,), (sizes.small_n,))],
    rank=15,
)
