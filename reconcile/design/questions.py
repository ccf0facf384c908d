"""Lists the open questions of a diagnosis, as pairs of models that an experiment could separate."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from scipy.stats import norm

from reconcile.catalogue.entry import TypicalSizes
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.registry import ENTRIES, TIMING, confused_with, family
from reconcile.catalogue.smooth_terms import PREFIX, SMOOTH_TERMS
from reconcile.design.model_discrimination import AssumedTerm, Model, Term
from reconcile.design.recorded_axis import RecordedAxis
from reconcile.identification.explain import Explanation
from reconcile.identification.findings import LEAST_CONFIDENCE, LEAST_REPORTED_GAIN, IdentifiedEffect
from reconcile.identification.rivals import RIVAL_STANDARD_ERRORS

CONTESTED, MISTAKEN, UNEXPLAINED, HIDDEN = "contested", "mistaken", "unexplained", "hidden"
MISTAKEN_WEIGHT = 0.1
"""Weight of an effect that is often mistaken for the identified one, at any confidence."""
HIDDEN_WEIGHT = 0.3
"""Weight of all possibly hidden effects of one channel together; 1 is a name that is entirely open."""
SMOOTH_COORDINATES = (
    "position",
    "velocity",
    "speed_by_direction",
    "acceleration",
    "force",
    "distance_since_reversal",
)
"""Coordinates of smooth terms that vary within a minute of motion."""
MAX_SHAPES = 8
"""Most shape parameters of one effect that are compared; the catalogue may scan more."""
MIN_RIVAL_CONFIDENCE = float(norm.sf(RIVAL_STANDARD_ERRORS))
LARGE_SHARE, SMALL_SHARE = 0.2, 0.1
"""Typical sizes of another friction and of a ripple, share of the Coulomb friction."""
BY_RANK = sorted(ENTRIES.values(), key=lambda entry: entry.rank)


class Question(NamedTuple):
    """Which of two models is true? Or: is a hidden effect of the assumed size there?"""

    kind: str
    weight: float
    separates: tuple[str, ...]
    true_models: tuple[Model, ...] = ()
    """Variants of the first model."""
    rival_models: tuple[Model, ...] = ()
    assumed: AssumedTerm | None = None
    """For a hidden effect, instead of both lists of models."""
    base_model: Model = ()
    """The terms beside the assumed one, which are not in question."""


def questions(explanation: Explanation, recorded: RecordedAxis) -> list[Question]:
    """Return the open questions of one channel of one axis."""
    datasets = [residual.data for residual in explanation.residuals]
    everything = (*explanation.findings, *explanation.minor)
    terms = [(c.effect, c.shape_parameters) for f in everything for c in f.candidates]
    if explanation.timing is not None:
        terms.append(explanation.timing)
    whole: Model = tuple(dict.fromkeys(terms))
    named = {finding.effect for finding in everything}
    open_questions: list[Question] = []
    for finding in explanation.findings:
        if finding.effect == "unknown":
            open_questions += _unexplained(finding, whole, datasets, explanation.channel, recorded)
        else:
            open_questions += _contested(finding, whole, named, datasets, explanation.channel)
    for finding in explanation.minor:
        if finding.heldout_gain >= LEAST_REPORTED_GAIN and finding.confidence < LEAST_CONFIDENCE:
            open_questions += _contested(finding, whole, named, datasets, explanation.channel)
    lost = any(f.effect == "unknown" and not f.candidates for f in explanation.findings)
    return open_questions + _hidden(
        whole, named, explanation.channel, recorded, 1.0 if lost else HIDDEN_WEIGHT
    )


def _contested(
    finding: IdentifiedEffect,
    whole: Model,
    named: set[str],
    datasets: Sequence[RegressionData],
    channel: ResidualChannel,
) -> Iterator[Question]:
    """Yield an effect against its rivals in these recordings, and against effects often mistaken for it."""
    own = tuple((c.effect, c.shape_parameters) for c in finding.candidates)
    base_model = tuple(term for term in whole if term not in own)
    weights = dict.fromkeys(confused_with(finding.effect), (MISTAKEN, MISTAKEN_WEIGHT))
    doubted = [r for r in finding.rivals if r.confidence > MIN_RIVAL_CONFIDENCE]
    weights.update({r.effect: (CONTESTED, _bits(r.confidence)) for r in doubted})
    own_models = (own, *((term,) for term in _terms(finding.effect, datasets, channel)))
    for name, (kind, weight) in weights.items():
        if name in named or {name, finding.effect} <= TIMING:
            continue
        if others := _terms(name, datasets, channel):
            true = tuple((*base_model, *one) for one in own_models)
            rivals = tuple((*base_model, one) for one in others)
            yield Question(kind, weight, (finding.effect, name), true, rivals)


def _bits(probability: float) -> float:
    """Return the entropy of a choice between two in bits; 1 if both are equally likely."""
    p = min(max(probability, 1e-9), 0.5)
    return -(p * math.log2(p) + (1.0 - p) * math.log2(1.0 - p))


def _unexplained(
    finding: IdentifiedEffect,
    whole: Model,
    datasets: Sequence[RegressionData],
    channel: ResidualChannel,
    recorded: RecordedAxis,
) -> Iterator[Question]:
    """Yield the coordinate of an unnamed term against other coordinates and against plausible effects."""
    own = tuple((c.effect, c.shape_parameters) for c in finding.candidates)
    if not own:
        return
    base_model = tuple(term for term in whole if term not in own)
    rivals: dict[str, list[Term]] = {
        PREFIX + name: [(PREFIX + name, shape) for shape in SMOOTH_TERMS[name].shapes(datasets)[:1]]
        for name in SMOOTH_COORDINATES
    }
    for assumed in _plausible_terms(recorded, channel):
        rivals.setdefault(assumed.term[0], []).append(assumed.term)
    for name, terms in rivals.items():
        if name != own[0][0] and terms[0] not in whole:
            pair, others = (own[0][0], name), tuple((*base_model, term) for term in terms)
            yield Question(UNEXPLAINED, 1.0 / len(rivals), pair, ((*base_model, *own),), others)


def _hidden(
    whole: Model, named: set[str], channel: ResidualChannel, recorded: RecordedAxis, weight: float
) -> list[Question]:
    candidates = [assumed for assumed in _plausible_terms(recorded, channel) if assumed.term[0] not in named]
    return [
        Question(HIDDEN, weight / len(candidates), assumed.term[:1], assumed=assumed, base_model=whole)
        for assumed in candidates
    ]


def _plausible_terms(recorded: RecordedAxis, channel: ResidualChannel) -> list[AssumedTerm]:
    """Return each effect of the catalogue at a size that is typical of machines; coefficients in N and m.

    The sizes are shares of the Coulomb friction, peak force and travel of the axis, or the middle of the
    range in the catalogue. They decide which effects to look for, not which ones exist.
    """
    coulomb_n, fastest_m_s = max(recorded.coulomb_n, 1e-3), max(recorded.max_velocity_m_s, 1e-6)
    low_m, high_m = recorded.min_position_m, recorded.max_position_m
    inertia_n = recorded.mass_kg * recorded.max_acceleration_m_s2
    sizes = TypicalSizes(
        coulomb_n=coulomb_n,
        large_n=LARGE_SHARE * coulomb_n,
        small_n=SMALL_SHARE * coulomb_n,
        peak_n=inertia_n + coulomb_n + recorded.viscous_n_s_m * fastest_m_s,
        fastest_m_s=fastest_m_s,
        over_travel=(2.0, 0.5 * (low_m + high_m), max(0.5 * (high_m - low_m), 1e-6)),
    )
    return [
        AssumedTerm((entry.name, term.shape_parameters), term.coefficients)
        for entry in BY_RANK
        if entry.family(channel)
        for term in entry.plausible(sizes)
        if term.channel in {None, channel}
    ]


def _terms(effect: str, datasets: Sequence[RegressionData], channel: ResidualChannel) -> list[Term]:
    """Return an effect at the shape parameters of the catalogue, thinned to about MAX_SHAPES."""
    of = family(effect, channel)
    shapes = of.shapes(datasets) if of else []
    return [(effect, shape) for shape in shapes[:: math.ceil(len(shapes) / MAX_SHAPES) or 1]]
