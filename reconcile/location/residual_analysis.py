"""Residual analysis of one channel of one axis: location, noise floor, whiteness (Ljung 1999, chapter 16)."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.explain import Explanation
from reconcile.location.locate import LocatedResidual, locate, located_json
from reconcile.regression.residual import Residual
from reconcile.regression.residual_noise import NoiseFloor, noise_floor, noise_json
from reconcile.regression.whiteness import Whiteness, whiteness

MODELS = ("before", "refitted", "after")
"""Nominal values; refitted values; refitted values with the identified effects."""
LEAST_REPORTED_SHARE = 0.002
"""Least share of the variance that verdict.json lists: below, a location does not help to find a cause."""


class ResidualAnalysis(NamedTuple):
    """The analysis of one channel of one axis."""

    axis: str
    channel: ResidualChannel
    residuals: list[Residual]
    located: list[LocatedResidual]
    """The coordinate or line that explains most first."""
    floor: NoiseFloor
    whiteness_by_model: dict[str, Whiteness]
    """By name in MODELS."""
    nominal: NominalAxis


def residual_analyses(
    explanations: Mapping[str, Sequence[Explanation]], axes: Mapping[str, NominalAxis]
) -> list[ResidualAnalysis]:
    """Analyse every channel of a diagnosis, axis by axis."""
    return [
        analyse_residuals(
            name,
            explanation.channel,
            explanation.residuals,
            axes[name],
            explanation.base.get("mass_kg", axes[name].mass_kg),
        )
        for name, of_axis in explanations.items()
        for explanation in of_axis
    ]


def analyse_residuals(
    name: str, channel: ResidualChannel, residuals: list[Residual], axis: NominalAxis, mass_kg: float
) -> ResidualAnalysis:
    """Analyse one channel of the axis `name`; `mass_kg` as identified."""
    return ResidualAnalysis(
        axis=name,
        channel=channel,
        residuals=residuals,
        located=locate(residuals, channel, axis),
        floor=noise_floor(residuals, channel, mass_kg),
        whiteness_by_model={
            model: whiteness(residuals, residuals_of_model(residuals, model)) for model in MODELS
        },
        nominal=axis,
    )


def residuals_of_model(residuals: Sequence[Residual], model: str) -> list[Array]:
    """The residuals of one of MODELS, by recording, (n,) each."""
    return [getattr(residual, model) for residual in residuals]


def located_of_verdict(analyses: Sequence[ResidualAnalysis]) -> list[dict[str, Any]]:
    """`located` of verdict.json: by channel, the largest share first."""
    return [
        located_json(analysis.axis, located)
        for analysis in analyses
        for located in analysis.located
        if located.share >= LEAST_REPORTED_SHARE
    ]


def noise_of_verdict(analyses: Sequence[ResidualAnalysis]) -> dict[str, dict[str, Any]]:
    """`noise_floor` of verdict.json, by axis and channel."""
    by_axis: dict[str, dict[str, Any]] = {}
    for analysis in analyses:
        of_axis = by_axis.setdefault(analysis.axis, {})
        of_axis[analysis.channel.value] = noise_json(analysis.floor, analysis.whiteness_by_model)
    return by_axis
