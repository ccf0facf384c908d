"""From selected terms to reported effects: parameters with intervals, rivals, confidence, held-out gain."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Index
from reconcile.catalogue.kinds import ShapeParameters
from reconcile.catalogue.registry import ENTRIES, TIMING
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import meaning_of
from reconcile.identification.confidence import confidence
from reconcile.identification.parameter_estimates import RESAMPLES, Estimate, estimates
from reconcile.identification.rivals import RivalEffect, largest_doubt, law_of_curve
from reconcile.regression.candidate_term import CandidateTerm, effect_names
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
    doubt: float = 0.0
    """Probability that an effect outside its class predicts held-out blocks better."""

    @property
    def law(self) -> str:
        """Effect of the catalogue that an unnamed curve is; empty if none."""
        return law_of_curve(self.candidates[0].effect, self.rivals) if self.candidates else ""


class ReportedEffects(NamedTuple):
    """The effects of a channel, ready for the verdict."""

    findings: list[IdentifiedEffect]
    minor: list[IdentifiedEffect]
    """In the model, but too small or too uncertain to be reported."""
    base: dict[str, Estimate]
    timing: tuple[str, ShapeParameters] | None
    """Term that models a lag below one sample, if any."""
    timing_s: float
    """That lag, which comes from sampling and not from physics; 0 without one."""


def report_findings(
    problem: RegressionProblem,
    chosen: list[CandidateTerm],
    rivals: dict[str, tuple[float, list[RivalEffect]]],
    train: Index,
    held_out_blocks: Index,
    resamples: int = RESAMPLES,
) -> ReportedEffects:
    """Report each effect with parameters, rivals and held-out gain, unless it is too short to resolve.

    Held-out blocks judge the fit to the training blocks; the parameters are then those of a fit to all
    blocks.
    """
    everything = np.sort(np.concatenate((train, held_out_blocks)))
    values = estimates(problem, chosen, everything, resamples)
    judge = _HeldOutJudge(problem, chosen, train, held_out_blocks)
    period_s, resolvable_m = problem.datasets[0].period_s, reversal_travel_m(problem.datasets)
    identified: list[IdentifiedEffect] = []
    timing, timing_s = None, 0.0
    for effect in effect_names(chosen):
        own = [c for c in chosen if c.effect == effect]
        if effect in TIMING and abs(values.of_term[own[0]]["time_s"].value) < period_s:
            timing, timing_s = (effect, own[0].shape_parameters), values.of_term[own[0]]["time_s"].value
        elif not _is_step_at_reversal(own, resolvable_m):
            identified.append(
                _identified_effect(own, [values.of_term[c] for c in own], rivals[effect], judge)
            )
    minor = [f for f in identified if _is_minor(f)]
    return ReportedEffects([f for f in identified if f not in minor], minor, values.base, timing, timing_s)


class _HeldOutJudge:
    """Held-out squares of models with the chosen terms, fitted to the training blocks."""

    def __init__(
        self,
        problem: RegressionProblem,
        chosen: Sequence[CandidateTerm],
        train: Index,
        held_out_blocks: Index,
    ) -> None:
        self.channel = problem.channel
        self._equations, self._chosen, self._blocks = problem.equations, chosen, held_out_blocks
        self._totals = problem.equations.totals(train)
        period_s = problem.datasets[0].period_s
        samples = float(problem.equations.samples[held_out_blocks].sum())
        self.duration_s = samples * (stride(period_s) * period_s)
        """Duration of the held-out blocks in motion."""
        self._best, self._baseline = self._squares(chosen), self._squares([])

    def gain(self, effect: str) -> float:
        """Share of the squares of a model without an effect that the effect removes."""
        without = self._squares([c for c in self._chosen if c.effect != effect])
        return 1.0 - self._best / max(without, 1e-300)

    def share(self, own: Sequence[CandidateTerm]) -> float:
        """Share of the squares of a model without any term that these terms remove alone."""
        return 1.0 - self._squares(own) / max(self._baseline, 1e-300)

    def _squares(self, model: Sequence[CandidateTerm]) -> float:
        slots = self._equations.slots(model)
        theta = self._equations.solve(slots, self._totals)
        return float(self._equations.squares(slots, theta, self._blocks).sum())


def _is_step_at_reversal(own: Sequence[CandidateTerm], resolvable_m: float) -> bool:
    """Return whether an effect ends, after a reversal, within a distance that is not resolved."""
    effect = own[0].effect
    if effect.startswith(PREFIX) or not ENTRIES[effect].ends_with_reversal:
        return False
    return max(c.shape_parameters[0] for c in own) < resolvable_m


def _identified_effect(
    own: list[CandidateTerm],
    values: Sequence[dict[str, Estimate]],
    rivals: tuple[float, list[RivalEffect]],
    judge: _HeldOutJudge,
) -> IdentifiedEffect:
    """An effect with the `values` of each of its `own` terms."""
    effect, (gain, others) = own[0].effect, rivals
    parameters = {}
    for number, of_term in enumerate(values, start=1):
        end = f"_{number}" if len(own) > 1 else ""
        parameters.update({key + end: estimate for key, estimate in of_term.items()})
    unnamed, heldout_gain = effect.startswith(PREFIX), judge.gain(effect)
    # an unnamed term may have changed within a held-out stretch, so its cross-validated gain counts too
    judged_gain = max(gain, heldout_gain) if unnamed else heldout_gain
    law = law_of_curve(effect, others)
    indistinguishable = [r.effect for r in others if r.is_indistinguishable]
    doubt = largest_doubt([r for r in others if r.effect != law], unnamed=unnamed)
    meaning = meaning_of(effect)
    return IdentifiedEffect(
        effect="unknown" if unnamed else effect,
        channel=judge.channel.value,
        confidence=confidence(doubt, judged_gain, judge.duration_s),
        equivalent=[*dict.fromkeys([*meaning.equivalent, *indistinguishable])],
        rivals=others,
        candidates=own,
        parameters=parameters,
        gain=gain,
        heldout_gain=heldout_gain,
        explanation=meaning.sentence({key: estimate.value for key, estimate in values[0].items()}),
        share=judge.share(own),
        doubt=doubt,
    )


def _is_minor(finding: IdentifiedEffect) -> bool:
    """Whether an effect is too uncertain, or explains too little of the held-out blocks, to be reported."""
    gain = max(finding.heldout_gain, finding.gain if finding.effect == "unknown" else 0.0)
    return finding.confidence < LEAST_CONFIDENCE or gain < LEAST_REPORTED_GAIN or _may_be_on_time(finding)


def _may_be_on_time(finding: IdentifiedEffect) -> bool:
    """Whether an effect is a delay or lag whose interval includes zero."""
    times_s = [value for name, value in finding.parameters.items() if name.startswith("time_s")]
    return finding.effect in TIMING and any(time_s.low <= 0.0 for time_s in times_s)
