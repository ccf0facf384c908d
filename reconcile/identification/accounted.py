"""The RMS of a channel by its parts: rigid model, each effect, unnamed terms, sensor noise, unexplained."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm, effect_names
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.regression.residual import rms_between
from reconcile.regression.resolution import force_step_n
from reconcile.sensing.channel import quantum

NOISE_RATIO = 1.5
"""RMS of a residual over the noise floor up to which it counts as noise: the floor is estimated."""
UNNAMED = "unnamed terms"
LEAST_UNEXPLAINED_RATIO = 0.45
"""Least RMS of a named effect over what is unexplained, of which a smaller one may be a part. Chosen."""
ROUNDINGS_OF_A_COUNT = 2.0
"""RMS of a line that reaches a count at its ends, over that of rounding: 1/sqrt(3) over 1/sqrt(12). What
stays within a count may be the gratings' own."""


class Accounted(NamedTuple):
    """RMS values of one channel over the used samples of all recordings, N or m."""

    measured: float
    """The channel itself, behind the filter."""
    rigid: float
    """Baseline: mass, viscous and Coulomb friction; in the deviation, origin and delay."""
    effects: dict[str, float]
    """Each effect beside the others; all unnamed terms together are `UNNAMED`."""
    residual: float
    """Measured less all parts of the model, noise included."""
    noise: float
    """Noise floor of the sensors."""
    negligible_rms: float
    """Least RMS of a relevant effect: a share of the measured force; in the deviation, the rounding."""
    rounding: float = 0.0
    """Quantisation of the sensors, before any filter."""
    least_named: float = 0.0
    """Least RMS of an effect that is named, if more than the relevant one: one that reaches a count."""

    @property
    def unexplained(self) -> float:
        """RMS of the residual without the noise, N or m."""
        return rms_between(self.residual, self.noise)

    @property
    def is_noise(self) -> bool:
        """Whether the residual is sensor noise, rounding, or negligible."""
        return self.residual <= max(NOISE_RATIO * self.noise, self.least_reported)

    @property
    def least_reported(self) -> float:
        """Least RMS of an unnamed term or residual that is reported, N or m."""
        return max(self.negligible_rms, self.rounding)

    def is_relevant(self, effect: str) -> bool:
        """Return whether an effect is large enough to be reported; `unknown` stands for all unnamed terms."""
        if effect == "unknown":
            return self.effects.get(UNNAMED, math.inf) >= self.least_reported
        least = max(self.negligible_rms, self.least_named, LEAST_UNEXPLAINED_RATIO * self.unexplained)
        return self.effects.get(effect, math.inf) >= least

    def as_json(self, unit: str) -> dict[str, Any]:
        """Return the entry of `accounted` in verdict.json; a share is of the measured square."""
        measured = max(self.measured, 1e-300)
        rows = {"rigid": self.rigid, **self.effects, "noise": self.noise, "unexplained": self.unexplained}
        return {
            "unit": unit,
            "measured": self.measured,
            "parts": {name: {"rms": rms, "share": (rms / measured) ** 2} for name, rms in rows.items()},
            "left": self.residual,
            "unexplained_floors": self.unexplained / max(self.noise, 1e-300),
            "matters": self.negligible_rms,
            "rounding": self.rounding,
            "is_noise": self.is_noise,
        }


def accounted(
    problem: RegressionProblem, terms: Sequence[CandidateTerm], weights: Array, *, noise: float, share: float
) -> Accounted:
    """Split the channel into its parts.

    `weights` (k,): coefficients before normalisation; `noise`: noise floor, N or m; `share`: of the measured
    RMS, below which an effect is negligible.
    """
    slots = problem.equations.slots(terms)
    places: dict[str, list[int]] = {"": [*range(len(problem.equations.slots([])))]}
    for candidate, at in problem.equations.placed(terms):
        name = UNNAMED if candidate.effect.startswith(PREFIX) else candidate.effect
        places.setdefault(name, []).extend(at)
    squares = dict.fromkeys((*places, "measured", "residual"), 0.0)
    samples = 0
    for recording in range(problem.equations.recordings):
        used = problem.used[recording]
        residual, samples = problem.target(recording)[used], samples + int(used.sum())
        squares["measured"] += float(residual @ residual)
        for name, own in places.items():
            here = [(slots[i][0], float(weights[i])) for i in own if slots[i][1] in (-1, recording)]
            part = problem.prediction(recording, here)[used]
            squares[name] += float(part @ part)
            residual -= part
        squares["residual"] += float(residual @ residual)
    is_force, rounding = problem.channel is ResidualChannel.FORCE, _rounding(problem)
    rms = {name: math.sqrt(value / max(samples, 1)) for name, value in squares.items()}
    named = {name: rms[name] for name in (*effect_names(terms), UNNAMED) if name in places}
    return Accounted(
        measured=rms["measured"],
        rigid=rms[""],
        effects=named,
        residual=rms["residual"],
        noise=noise,
        negligible_rms=share * rms["measured"] if is_force else rounding,
        rounding=rounding,
        least_named=0.0 if is_force else ROUNDINGS_OF_A_COUNT * rounding,
    )


def _rounding(problem: RegressionProblem) -> float:
    """RMS of the sensors' quantisation, N or m, unfiltered: in slow motion the filter does not reduce it."""
    datasets = problem.datasets
    if problem.channel is ResidualChannel.FORCE:
        steps = [max(map(force_step_n, datasets))]
    else:
        scales = [data.scale_m for data in datasets if data.scale_m is not None]
        steps = [max(map(quantum, of)) for of in ([data.motion.position_m for data in datasets], scales)]
    return math.sqrt(sum(step**2 for step in steps) / 12.0)
