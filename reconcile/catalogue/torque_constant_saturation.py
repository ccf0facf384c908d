"""A torque constant that falls at high current, Kt(i) = Kt (1 - c i^2)."""

import math
from collections.abc import Sequence

import numpy as np

from hil_sim.physics.motor import torque_constant_saturation as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, NotInAPlant, PlantValues
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, TermFamily

DEEPEST = 0.9
"""Largest share of the saturated force at which the plant's law is converted to a loss; chosen."""


def _strongest(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    strongest_n = max(float(np.abs(data.model_force_n).max()) for data in datasets)
    return [(strongest_n,)] if strongest_n > 0.0 else []


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    """Return the column whose coefficient is the lost share of the strongest force."""
    return (data.model_force_n * (data.model_force_n / shape[0]) ** 2)[:, None]


def _to_plant(found: IdentifiedTerms, _notes: list[str]) -> PlantValues:
    """Kf i / sqrt(1 + (i / Is)^2) = F for the current i = (1 + loss) F / Kf at the strongest F."""
    loss, peak_n = found.terms[0]["loss_at_peak"], found.terms[0]["peak_n"]
    if loss <= 0.0:
        raise NotInAPlant("it was found that more force comes of a high current, and not less")
    return {"saturation_a": peak_n / found.axis.force_constant_n_a / math.sqrt(1.0 - (1.0 + loss) ** -2)}


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """Return the loss A / F - 1 at the strongest force, of the plant's law F = A / sqrt(1 + (A / Fs)^2)."""
    saturated_n = of.params.saturation_a * of.axis.force_constant_n_a
    terms = []
    for (strongest_n,) in _strongest(of.datasets):
        peak_n = min(strongest_n, DEEPEST * saturated_n)
        loss = 1.0 / math.sqrt(1.0 - (peak_n / saturated_n) ** 2) - 1.0
        terms.append(ModelTerm(of.effect, (peak_n,), (loss,)))
    return terms


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _strongest),),
    coefficients={"loss_at_peak": ""},
    shape_parameters={"peak_n": "N"},
    sentence=lambda p: (
        f"at the strongest force {100.0 * p['loss_at_peak']:.1f} % of what the current promises are missing, "
        "and less than in proportion below: the torque constant saturates"
    ),
    physical=POSITIVE,  # force is lost, not won
    presliding_can_imitate=True,
    to_plant=_to_plant,
    from_plant=_from_plant,
    rivals=(
        Rival("quadratic_viscous_friction"),
        Rival("voltage_saturation", "a torque constant is lost at low speed too, voltage only at high speed"),
        Rival(
            "payload_mass", "a known mass shows what a newton of the drive is worth", experiment="added mass"
        ),
    ),
    shown_by="force is lost at its peaks, at any speed",
    plausible=lambda sizes: [PlausibleTerm((sizes.peak_n,), (0.05,))],
    rank=13,
)
