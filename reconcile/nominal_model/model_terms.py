"""The model effects as terms of the catalogue, the inverse of a model update.

Parameters without columns in the catalogue are omitted: friction_ageing, lubrication_loss, the inductance
of a winding, the bow of a guide, the ripple of position_dependent_friction, damping of drive_compliance.
"""

from collections.abc import Sequence

from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import CATALOGUE
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters


def terms_of_model(axis: NominalAxis, datasets: Sequence[RegressionData]) -> list[ModelTerm]:
    """Return the model effects as terms of the catalogue, with their coefficients for these recordings.

    Drifts are those of the first recording, as in the model update. Offsets that differ by recording (a
    re-zeroed encoder, the begin of a disturbance) are those of the model.
    """
    given, base = axis.model_effects, baseline_parameters(axis)
    sums: dict[tuple[str, ShapeParameters, ResidualChannel], tuple[float, ...]] = {}
    for effect, params in given.effects.items():
        if effect not in CATALOGUE:
            continue
        of = ModelEffect(
            effect=effect,
            params=params,
            effects=given.effects,
            other=given.followed.get(effect, ""),
            axis=axis,
            base=base,
            datasets=datasets,
        )
        for one in CATALOGUE[effect].model_terms(of):
            same = one.effect, one.shape_parameters, one.channel
            before = sums.get(same, (0.0,) * len(one.coefficients))
            sums[same] = tuple(a + b for a, b in zip(before, one.coefficients, strict=True))
    return [
        ModelTerm(effect, shape, coefficients, channel)
        for (effect, shape, channel), coefficients in sums.items()
        if any(coefficients)
    ]
