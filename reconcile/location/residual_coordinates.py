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
    """One channel of one axis."""

    axis: str
    channel: ResidualChannel
    residuals: list[Residual]
    located: list[LocatedResidual]
    floor: NoiseFloor
    whiteness_by_model: dict[str, Whiteness]
    nominal: NominalAxis


def residual_analyses(
    explanations: Mapping[str, Sequence[Explanation]], axes: Mapping[str, NominalAxis]
) -> list[ResidualAnalysis]:
    """Analyse every channel of a diagnosis, axis by axis."""
    return [
        analyse_residuals(name, e.channel, e.residuals, axes[name], e.base.get("mass_kg", axes[name].mass_kg))
        for name, own in explanations.items()
        for e in own
    ]


def analyse_residuals(
    name: str, channel: ResidualChannel, residuals: list[Residual], axis: NominalAxis, mass_kg: float
) -> ResidualAnalysis:
    """Analyse one channel; `mass_kg` as identified."""
    located, floor = locate(residuals, channel, axis), noise_floor(residuals, channel, mass_kg)
    white = {model: whiteness(residuals, residuals_of_model(residuals, model)) for model in MODELS}
    return ResidualAnalysis(
        axis=name,
        channel=channel,
        residuals=residuals,
        located=located,
        floor=floor,
        whiteness_by_model=white,
        nominal=axis,
    )


def residuals_of_model(residuals: Sequence[Residual], model: str) -> list[Array]:
    """The residuals of one of MODELS, by recording, (n,) each."""
    return [getattr(residual, model) for residual in residuals]


def verdict_places(analyses: Sequence[ResidualAnalysis]) -> list[dict[str, Any]]:
    """`located` of verdict.json: by channel, the largest share first."""
    return [
        located_json(one.axis, place)
        for one in analyses
        for place in one.located
        if place.share >= LEAST_REPORTED_SHARE
    ]


def verdict_noise(analyses: Sequence[ResidualAnalysis]) -> dict[str, dict[str, Any]]:
    """`noise_floor` of verdict.json, by axis and channel."""
    found: dict[str, dict[str, Any]] = {}
    for one in analyses:
        found.setdefault(one.axis, {})[one.channel.value] = noise_json(one.floor, one.whiteness_by_model)
    return found
