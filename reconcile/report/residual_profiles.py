"""Means of a residual over binned coordinates, for each model: the data of the report's profile figures."""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.location.coordinates import Coordinate, coordinates
from reconcile.location.explained_share import bins_in_use, explained_share, samples_in_use
from reconcile.location.locate import in_phase
from reconcile.location.residual_analysis import (
    LEAST_REPORTED_SHARE,
    MODELS,
    ResidualAnalysis,
    residuals_of_model,
)

MEASURED = "measured"
"""Name beside those of the models: the channel itself, without a model."""
MIN_COORDINATES, MAX_COORDINATES = 3, 6
"""Fewest and most drawn coordinates, however little they explain."""


class ResidualProfile(NamedTuple):
    """Means over the bins of a coordinate by model; arrays (bins,)."""

    coordinate: Coordinate
    by_direction: bool
    """Samples were multiplied by the direction of motion before averaging."""
    share: float
    """Cross-validated share of the variance that no value of the nominal model explains."""
    means: dict[str, Array]
    errors: dict[str, Array]
    counts: Array


class ResidualProfiles:
    """The profiles of one analysed residual."""

    def __init__(self, analysis: ResidualAnalysis) -> None:
        self._analysis = analysis
        residuals = analysis.residuals
        self._by_name = {one.name: one for one in coordinates(residuals, analysis.channel)}
        self._samples = {}
        for model in (*MODELS, MEASURED):
            pairs = zip(residuals, residuals_of_model(residuals, model), strict=True)
            self._samples[model] = samples_in_use(residuals, [in_phase(one, values) for one, values in pairs])

    def best(self) -> list[ResidualProfile]:
        """Return the profiles over the best explaining coordinates, the largest share first."""
        located = [one for one in self._analysis.located if one.coordinate in self._by_name]
        count = max(sum(one.share >= LEAST_REPORTED_SHARE for one in located), MIN_COORDINATES)
        return [
            self._profile(self._by_name[one.coordinate], by_direction=one.by_direction, share=one.share)
            for one in located[: min(count, MAX_COORDINATES)]
        ]

    def by_direction(self, name: str) -> dict[str, ResidualProfile]:
        """Return the profiles of `forwards` and `backwards` motion; empty if the coordinate is absent."""
        coordinate = self._by_name.get(name)
        if coordinate is None:
            return {}
        found = {}
        for direction, sign in (("forwards", 1.0), ("backwards", -1.0)):
            bins = [
                np.where(residual.data.motion.last_direction == sign, all_bins, -1)
                for residual, all_bins in zip(self._analysis.residuals, coordinate.bins, strict=True)
            ]
            found[direction] = self._profile(coordinate._replace(bins=bins), by_direction=False, share=0.0)
        return found

    def _profile(self, coordinate: Coordinate, *, by_direction: bool, share: float) -> ResidualProfile:
        bins = bins_in_use(coordinate, self._analysis.residuals)
        by_model = {
            model: explained_share(given, bins, coordinate.size, signed_by_direction=by_direction)
            for model, given in self._samples.items()
        }
        return ResidualProfile(
            coordinate=coordinate,
            by_direction=by_direction,
            share=share,
            means={model: one.mean for model, one in by_model.items()},
            errors={model: one.errors for model, one in by_model.items()},
            counts=by_model["after"].counts,
        )
