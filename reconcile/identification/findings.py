"""From selected terms to reported effects: parameters with intervals, rivals, confidence, held-out gain."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from kernels.arrays import Index
from reconcile.catalogue.kinds import ShapeParameters
from reconcile.catalogue.registry import ENTRIES, TIMING
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import meaning_of
from reconcile.identification.confidence import confidence
from reconcile.identification.parameter_estimates import RESAMPLES, Estimate, estimates
from reconcile.identification.rivals import RIVAL_STANDARD_ERRORS, RivalEffect
from reconcile.regression.normal_equations import CandidateTerm, effect_names
from reconcile.regression.regression_data import stride
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.regression.resolution import reversal_travel_m

LEAST_REPORTED_GAIN = 0.1
"""Least share of the unexplained held-out variance of a reported effect."""
LEAST_CONFIDENCE = 0.4
"""Least confidence of a reported effect: below, a rival is the more probable name."""


class IdentifiedEffect(NamedTuple):
    """An effect that the nominal model lacks."""

    effect: str
    channel: str
    confidence: float
    equivalent: list[str]
    rivals: list[RivalEffect]
    candidates: list[CandidateTerm]
    parameters: dict[str, Estimate]
    gain: float
    """Share of the unexplained variance that it explains, cross-validated."""
    heldout_gain: float
    explanation: str
    share: float = 0.0
    """Share of the held-out variance that it explains alone; findings are ranked by it."""


class ReportedEffects(NamedTuple):
    """The effects of a channel, ready for the verdict."""

    findings: list[IdentifiedEffect]
    minor: list[IdentifiedEffect]
    """In the model, but too small or too uncertain to be reported."""
    base: dict[str, Estimate]
    timing: tuple[str, ShapeParameters] | None
    """Term that models a lag below one sample, if any."""
    timing_s: float
    """That lag: how the channels were sampled, no physics; 0 without one."""


def report_findings(
    problem: RegressionProblem,
    chosen: list[CandidateTerm],
    rivals: dict[str, tuple[float, list[RivalEffect]]],
    train: Index,
    held_out_blocks: Index,
    resamples: int = RESAMPLES,
) -> ReportedEffects:
    """Report each effect with parameters, rivals and held-out gain, unless it is below the resolution.

    What is left out of the fit judges it; the parameters are then those of all blocks.
    """
    equations = problem.equations
    everything = np.sort(np.concatenate((train, held_out_blocks)))
    values, totals = estimates(problem, chosen, everything, resamples), equations.totals(train)
    period_s, resolvable_m = problem.datasets[0].period_s, reversal_travel_m(problem.datasets)

    def squares_held_out(model: Sequence[CandidateTerm]) -> float:
        slots = equations.slots(model)
        return float(equations.squares(slots, equations.solve(slots, totals), held_out_blocks).sum())

    kept_s = stride(period_s) * period_s
    held_out_s = float(equations.samples[held_out_blocks].sum()) * kept_s
    best, unexplained = squares_held_out(chosen), squares_held_out([])
    found: list[IdentifiedEffect] = []
    timing, timing_s = None, 0.0
    for effect in effect_names(chosen):
        own = [c for c in chosen if c.effect == effect]
        first = {key: estimate.value for key, estimate in values.of[own[0]].items()}
        if effect in TIMING and abs(first["time_s"]) < period_s:
            timing, timing_s = (effect, own[0].shape_parameters), first["time_s"]
            continue
        unnamed = effect.startswith(PREFIX)
        ends_with_reversal = not unnamed and ENTRIES[effect].ends_with_reversal
        if ends_with_reversal and max(c.shape_parameters[0] for c in own) < resolvable_m:
            continue
        gain, others = rivals[effect]
        indistinguishable = [r.effect for r in others if r.confidence > norm.sf(RIVAL_STANDARD_ERRORS)]
        parameters = {}
        for number, candidate in enumerate(own, start=1):
            end = f"_{number}" if len(own) > 1 else ""
            parameters.update({key + end: estimate for key, estimate in values.of[candidate].items()})
        heldout_gain = 1.0 - best / max(squares_held_out([c for c in chosen if c.effect != effect]), 1e-300)
        # what has no name may have changed within a held-out stretch, so its gain counts too
        judged_gain = max(gain, heldout_gain) if unnamed else heldout_gain
        meaning = meaning_of(effect)
        found.append(
            IdentifiedEffect(
                effect="unknown" if unnamed else effect,
                channel=problem.channel.value,
                confidence=confidence(
                    max([r.confidence for r in others], default=0.0), judged_gain, held_out_s
                ),
                equivalent=[*dict.fromkeys([*meaning.equivalent, *indistinguishable])],
                rivals=others,
                candidates=own,
                parameters=parameters,
                gain=gain,
                heldout_gain=heldout_gain,
                explanation=meaning.sentence(first),
                share=1.0 - squares_held_out(own) / max(unexplained, 1e-300),
            )
        )
    minor = [
        f
        for f in found
        if f.confidence < LEAST_CONFIDENCE
        or max(f.heldout_gain, f.gain if f.effect == "unknown" else 0.0) < LEAST_REPORTED_GAIN
    ]
    named = [f for f in found if f not in minor]
    return ReportedEffects(named, minor, values.base, timing, timing_s)
