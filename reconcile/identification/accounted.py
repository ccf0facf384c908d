"""Every newton accounted for: rigid model, each effect, terms without a name, sensor noise, unexplained."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.normal_equations import CandidateTerm, effect_names
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.sensing.channel import quantum

NOISE_RATIO = 1.5
"""RMS of a residual over the noise floor up to which it is noise: what the floor's spectrum does not show."""
UNNAMED = "unnamed terms"


class Accounted(NamedTuple):
    """RMS in the samples in use of all recordings, N or m."""

    measured: float
    """The channel itself, behind the filter."""
    rigid: float
    """What mass, viscous and Coulomb friction give; of the deviation, origin and delay."""
    effects: dict[str, float]
    """What each effect gives beside the others; all terms without a name together are `UNNAMED`."""
    left: float
    """What no part of the model explains."""
    noise: float
    """Noise floor of the sensors."""
    matters: float
    """Negligible below this: a share of the measured force; of the deviation, the rounding."""
    rounding: float = 0.0
    """Of the sensors, before any filter."""

    @property
    def unexplained(self) -> float:
        """What is left beside the noise, N or m."""
        return math.sqrt(max(self.left**2 - self.noise**2, 0.0))

    @property
    def is_noise(self) -> bool:
        """Whether what is left is sensor noise, rounding, or less than matters."""
        return self.left <= max(NOISE_RATIO * self.noise, self.least)

    @property
    def least(self) -> float:
        """Below this nothing without a name is spoken of: what matters, or the rounding, N or m."""
        return max(self.matters, self.rounding)

    def matter(self, effect: str) -> bool:
        """Whether an effect of the catalogue gives as much as matters, `unknown` as much as rounding too."""
        if effect == "unknown":
            return self.effects.get(UNNAMED, math.inf) >= self.least
        return self.effects.get(effect, math.inf) >= self.matters

    def as_json(self, unit: str) -> dict[str, Any]:
        """An entry of `accounted` in verdict.json; shares are of the squares of what is measured."""
        size = max(self.measured, 1e-300)
        rows = {"rigid": self.rigid, **self.effects, "noise": self.noise, "unexplained": self.unexplained}
        return {
            "unit": unit,
            "measured": self.measured,
            "parts": {name: {"rms": rms, "share": (rms / size) ** 2} for name, rms in rows.items()},
            "left": self.left,
            "unexplained_floors": self.unexplained / max(self.noise, 1e-300),
            "matters": self.matters,
            "rounding": self.rounding,
            "is_noise": self.is_noise,
        }


def accounted(
    problem: RegressionProblem,
    terms: Sequence[CandidateTerm],
    weights: Array,
    *,
    noise: float,
    share: float,
) -> Accounted:
    """Split what was measured; `weights` before normalisation, `share` of the measured RMS that matters."""
    slots = problem.equations.slots(terms)
    places: dict[str, list[int]] = {"": [*range(len(problem.equations.slots([])))]}
    first = len(places[""])
    for candidate in terms:
        name = UNNAMED if candidate.effect.startswith(PREFIX) else candidate.effect
        count = problem.equations.coefficients(candidate)
        places.setdefault(name, []).extend(range(first, first + count))
        first += count
    squares = dict.fromkeys((*places, "measured", "left"), 0.0)
    samples = 0
    for recording in range(problem.equations.recordings):
        used = problem.used[recording]
        left, samples = problem.target(recording)[used], samples + int(used.sum())
        squares["measured"] += float(left @ left)
        for name, own in places.items():
            here = [(slots[i][0], float(weights[i])) for i in own if slots[i][1] in (-1, recording)]
            part = problem.prediction(recording, here)[used]
            squares[name] += float(part @ part)
            left -= part
        squares["left"] += float(left @ left)
    rounding = _rounding(problem)
    rms = {name: math.sqrt(value / max(samples, 1)) for name, value in squares.items()}
    named = {name: rms[name] for name in (*effect_names(terms), UNNAMED) if name in places}
    return Accounted(
        measured=rms["measured"],
        rigid=rms[""],
        effects=named,
        left=rms["left"],
        noise=noise,
        matters=share * rms["measured"] if problem.channel is ResidualChannel.FORCE else rounding,
        rounding=rounding,
    )


def _rounding(problem: RegressionProblem) -> float:
    """RMS of the sensors' rounding, N or m: of slow motion the filter takes nothing away."""
    datasets = problem.datasets
    if problem.channel is ResidualChannel.FORCE:
        steps = [max(quantum(data.force_n) for data in datasets)]
    else:
        scales = [data.scale_m for data in datasets if data.scale_m is not None]
        steps = [max(map(quantum, of)) for of in ([data.motion.position_m for data in datasets], scales)]
    return math.sqrt(sum(step**2 for step in steps) / 12.0)
