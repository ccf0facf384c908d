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
"""Fewest coordinates that are drawn, however little they explain, and most; chosen."""


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
        self._by_name = {
            coordinate.name: coordinate for coordinate in coordinates(residuals, analysis.channel)
        }
        self._samples = {}
        for model in (*MODELS, MEASURED):
            pairs = zip(residuals, residuals_of_model(residuals, model), strict=True)
            shifted = [in_phase(residual, values) for residual, values in pairs]
            self._samples[model] = samples_in_use(residuals, shifted)

    def best(self) -> list[ResidualProfile]:
        """Return the profiles over the best explaining coordinates, the largest share first."""
        ranked = [located for located in self._analysis.located if located.coordinate in self._by_name]
        count = max(sum(located.share >= LEAST_REPORTED_SHARE for located in ranked), MIN_COORDINATES)
        return [
            self._profile(
                self._by_name[located.coordinate], by_direction=located.by_direction, share=located.share
            )
            for located in ranked[: min(count, MAX_COORDINATES)]
        ]

    def by_direction(self, name: str) -> dict[str, ResidualProfile]:
        """Return the profiles of `forwards` and `backwards` motion; empty if the coordinate is absent."""
        coordinate = self._by_name.get(name)
        if coordinate is None:
            return {}
        profiles = {}
        for direction, sign in (("forwards", 1.0), ("backwards", -1.0)):
            bins = [
                np.where(residual.data.motion.last_direction == sign, all_bins, -1)
                for residual, all_bins in zip(self._analysis.residuals, coordinate.bins, strict=True)
            ]
            profiles[direction] = self._profile(coordinate._replace(bins=bins), by_direction=False, share=0.0)
        return profiles

    def _profile(self, coordinate: Coordinate, *, by_direction: bool, share: float) -> ResidualProfile:
        bins = bins_in_use(coordinate, self._analysis.residuals)
        by_model = {
            model: explained_share(samples, bins, coordinate.size, signed_by_direction=by_direction)
            for model, samples in self._samples.items()
        }
        return ResidualProfile(
            coordinate=coordinate,
            by_direction=by_direction,
            share=share,
            means={model: explained.mean for model, explained in by_model.items()},
            errors={model: explained.errors for model, explained in by_model.items()},
            counts=by_model["after"].counts,
        )
