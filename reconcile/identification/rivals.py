"""Rivals: effects that could explain the data in place of an identified one."""

from collections.abc import Sequence
from typing import NamedTuple

from scipy.stats import norm

from reconcile.catalogue.registry import LAW_NEAR_CURVE, LAW_OF_CURVE
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.selection.block_statistics import log_ratio_t
from reconcile.selection.cross_validation import SHORTLIST, CrossValidation

RIVAL_STANDARD_ERRORS = 2.0
"""A rival whose cross-validated squares are worse by less, in standard errors, is indistinguishable."""
MOST_CLASS_DIFFERENCE = 0.05
"""Largest relative difference of the gains of two indistinguishable effects of one class, neither of which
puts the other in doubt. Chosen: a misfit of other effects changes the gains by more."""
LEAST_LAW_GAIN = 0.9
"""Least gain of a law over that of a curve, for the curve to be this law with another shape. Calibrated on
training cases: curves of a law had 0.94 and more, others 0.76 and less."""


class RivalEffect(NamedTuple):
    """Another effect that could explain the data in place of the identified one."""

    effect: str
    confidence: float
    """Probability that it predicts held-out folds better."""
    share: float
    """Its gain over that of the identified effect."""

    @property
    def is_indistinguishable(self) -> bool:
        """Whether these recordings cannot distinguish it from the identified effect."""
        return self.confidence > float(norm.sf(RIVAL_STANDARD_ERRORS))


def largest_doubt(rivals: Sequence[RivalEffect], *, unnamed: bool = False) -> float:
    """Return the largest probability that an effect outside the class of the identified one predicts better.

    An unnamed term is alone in its class: what a named effect explains as well is not unknown.
    """
    outside = [
        r
        for r in rivals
        if unnamed or not r.is_indistinguishable or abs(r.share - 1.0) > MOST_CLASS_DIFFERENCE
    ]
    return max([r.confidence for r in outside], default=0.0)


def law_of_curve(effect: str, rivals: Sequence[RivalEffect]) -> str:
    """Return the effect of the catalogue that an unnamed curve is; empty if it is none, or no curve."""
    coordinate = effect.removeprefix(PREFIX) if effect.startswith(PREFIX) else ""
    near = LAW_NEAR_CURVE.get(coordinate, "")
    if any(r.effect == near and r.share >= LEAST_LAW_GAIN for r in rivals):
        return near
    return LAW_OF_CURVE.get(coordinate, "")


def compare_rivals(
    validation: CrossValidation, chosen: Sequence[CandidateTerm], effect: str
) -> tuple[float, list[RivalEffect]]:
    """Return the gain of an effect beside all others, and the rivals with a gain in its place, best first."""
    equations = validation.equations
    others = [c for c in chosen if c.effect != effect]
    before = validation.cross_validated_squares(others)
    own_score = validation.score_last([*others, *(c for c in chosen if c.effect == effect)], before)
    chosen_effects = {c.effect for c in chosen}
    rivals_tried = [
        c
        for c in equations.candidates
        if c.effect not in chosen_effects
        and not c.effect.startswith(PREFIX)
        and not c.levels  # levels of each recording alone are not rivals
    ]
    rivals_tried.sort(key=lambda c: validation.explained_squares([*others, c]), reverse=True)
    best: dict[str, tuple[float, CandidateTerm]] = {}
    for candidate in rivals_tried[:SHORTLIST]:
        gain = validation.gain([*others, candidate], before)
        if gain > 0.0 and (candidate.effect not in best or gain > best[candidate.effect][0]):
            best[candidate.effect] = gain, candidate
    coefficients = sum(equations.coefficients(c) for c in chosen if c.effect == effect)
    compared = []
    for name, (_, candidate) in best.items():
        score = validation.score(others, before, candidate)
        # a rival with more coefficients must be better by as much as a further term must
        handicap = RIVAL_STANDARD_ERRORS if equations.coefficients(score.candidate) > coefficients else 0.0
        confidence = float(norm.sf(log_ratio_t(own_score.squares, score.squares) + handicap))
        compared.append(RivalEffect(name, confidence, score.gain / max(own_score.gain, 1e-12)))
    return own_score.gain, sorted(compared, key=lambda rival: rival.share, reverse=True)
