"""Chooses the next experiment: the motion with the largest expected evidence per second of machine time.

A diagnosis leaves pairs of models open (`questions`): an effect and its rivals, effects that are often
mistaken for one another, unnamed terms, and effects that may be hidden. Every candidate motion is rated on
all of them (`model_discrimination`). Where no motion helps, a manual experiment may.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from reconcile.catalogue.registry import distinguishing_observation
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.design.candidate_motions import PlannedMotion, candidate_motions
from reconcile.design.limits import AxisLimits, limits_from_recordings
from reconcile.design.manual_experiment import manual_experiment
from reconcile.design.model_discrimination import AssumedTerm, ModelDiscrimination
from reconcile.design.predicted_data import predicted_data
from reconcile.design.program import PROGRAM_FILE, program_steps
from reconcile.design.questions import CONTESTED, HIDDEN, UNEXPLAINED, Question, questions
from reconcile.design.recorded_axis import RecordedAxis, recorded_axis
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.explain import Explanation
from reconcile.regression.model_presliding import regressed_terms

DECISIVE_NATS = 100.0
"""Evidence beyond this has no further value. Chosen: ten would suffice for exact columns, times ten."""
MIN_NATS = 20.0
"""Least expected evidence for which a motion is proposed for a question."""
MIN_NATS_CONTESTED = 3.0
"""The same for an effect that already has a rival in these recordings: odds of twenty to one."""
UNDETECTED_NATS = 5.0
"""Evidence in the recordings up to which an effect may have stayed unidentified."""
RECORDING_OVERHEAD_S = 10.0
"""Time for referencing, starting and reading of each recording."""
MIN_PERIOD_S = 2e-3
"""Sample period of predicted motions; the regression's low pass removes what is faster."""
REPEATED_KIND_FACTOR = 0.5
"""Factor on the rating of a kind of motion for each earlier run of it that did not decide."""
MIN_SPEED_THRESHOLDS = 3.0
"""Slowest candidate motion, in velocity thresholds of the recordings: below them motion is noise."""
LISTED_MOTIONS = 6
"""Most motions in a verdict."""


class NextExperiment(NamedTuple):
    """The next experiment."""

    content: dict[str, Any]
    """`next_experiment` of verdict.json; empty where nothing is open."""
    program: list[dict[str, Any]]
    """Steps of a program file; empty for a manual experiment."""
    kind: str
    """Kind of the motion."""
    planned: PlannedMotion | None


class _RatedMotion(NamedTuple):
    """One motion of one axis, with its expected evidence on each question."""

    axis: str
    planned: PlannedMotion
    nats: list[float]
    value_1_s: float


NOTHING = NextExperiment({}, [], "", None)


def next_experiment(
    explanations: Mapping[str, Sequence[Explanation]],
    axes: Mapping[str, NominalAxis],
    limits: Mapping[str, AxisLimits] | None = None,
    made: Sequence[str] = (),
) -> NextExperiment:
    """Return the best motion of all axes, within `limits` or within the recorded motions.

    `made`: kinds of the motions that were run for earlier questions.
    """
    open_questions: dict[str, list[Question]] = {}
    rated: list[_RatedMotion] = []
    recorded = {name: recorded_axis(own, axes[name]) for name, own in explanations.items() if own}
    for name, of_axis in recorded.items():
        within = (limits or {}).get(name) or limits_from_recordings(of_axis)
        open_questions[name], nats = _expected_nats(explanations[name], axes[name], of_axis, within)
        rated += [
            _RatedMotion(name, planned, of_motion, _rating(open_questions[name], of_motion, planned, made))
            for planned, of_motion in nats
        ]
    best = max(rated, key=lambda one: one.value_1_s, default=None)
    if best is None or best.value_1_s <= 0.0:
        by_hand = manual_experiment(recorded, explanations)
        return NextExperiment(by_hand, [], "", None) if by_hand else NOTHING
    return _proposal(best, [one for one in rated if one.axis == best.axis], open_questions[best.axis])


def _expected_nats(
    of_axis: Sequence[Explanation], axis: NominalAxis, recorded: RecordedAxis, within: AxisLimits
) -> tuple[list[Question], list[tuple[PlannedMotion, list[float]]]]:
    """Return the open questions of an axis, and the expected evidence of each motion on each of them."""
    like = of_axis[0].residuals[0].data
    period_s = max(like.period_s, MIN_PERIOD_S)
    min_velocity_m_s = MIN_SPEED_THRESHOLDS * recorded.velocity_threshold_m_s
    motions = candidate_motions(within, period_s, min_velocity_m_s, recorded.min_stroke_m)
    datasets = [predicted_data(one.position_m, period_s, like, recorded) for one in motions]
    all_questions: list[Question] = []
    nats: list[list[float]] = [[] for _ in motions]
    for explanation in of_axis:
        listed = questions(explanation, recorded)
        terms = [
            term
            for q in listed
            for model in (*q.true_models, *q.rival_models, q.base_model)
            for term in model
        ]
        terms += [q.assumed.term for q in listed if q.assumed is not None]
        recordings = [residual.data for residual in explanation.residuals]
        model_terms = regressed_terms(axis, recordings, explanation.channel)
        discrimination = ModelDiscrimination(explanation.residuals, explanation.channel, model_terms, terms)
        unanswered = [kept for q in listed for kept in _unanswered(discrimination, q)]
        for of_motion, data in zip(nats, datasets, strict=True):
            motion = discrimination.motion_products(data)
            of_motion += [_question_nats(discrimination, q, motion) for q in unanswered]
        all_questions += unanswered
    return all_questions, list(zip(motions, nats, strict=True))


def _question_nats(discrimination: ModelDiscrimination, q: Question, motion: tuple[Any, float]) -> float:
    """Return the expected evidence of a motion; of two models the mean of both directions."""
    if q.assumed is not None:
        both = discrimination.evidence_of_term(q.assumed, q.base_model, motion)
        return max(both - discrimination.evidence_of_term(q.assumed, q.base_model, None), 0.0)
    there = discrimination.expected_gain(q.true_models, q.rival_models, motion)
    return 0.5 * (there + discrimination.expected_gain(q.rival_models, q.true_models, motion))


def _unanswered(discrimination: ModelDiscrimination, q: Question) -> list[Question]:
    """Return the question unless the recordings answer it; a hidden effect at most as large as it can be."""
    if q.assumed is not None:
        width = discrimination.width(q.assumed.term)
        if width == 0:
            return []
        assumed = q.assumed._replace(coefficients=(*q.assumed.coefficients, 0.0, 0.0)[:width])
        nats = discrimination.evidence_of_term(assumed, q.base_model, None)
        scale = min(1.0, (UNDETECTED_NATS / nats) ** 0.5) if nats > 0.0 else 1.0
        return [q._replace(assumed=AssumedTerm(assumed.term, tuple(scale * c for c in assumed.coefficients)))]
    rivals = tuple(model for model in q.rival_models if discrimination.width(model[-1]))
    true = tuple(model for model in q.true_models if all(discrimination.width(term) for term in model))
    if not (rivals and true):
        return []
    evidence = discrimination.recorded_evidence
    nats = 0.5 * (evidence(true, rivals) + evidence(rivals, true))
    answered = nats >= MIN_NATS and q.kind != CONTESTED
    return [] if answered else [q._replace(rival_models=rivals, true_models=true)]


def _rating(
    open_questions: Sequence[Question], nats: Sequence[float], one: PlannedMotion, made: Sequence[str]
) -> float:
    """Return the value of a motion per second of machine time."""
    value = sum(_value(q, of_question) for q, of_question in zip(open_questions, nats, strict=True))
    return REPEATED_KIND_FACTOR ** made.count(one.motion.kind) * value / (one.seconds + RECORDING_OVERHEAD_S)


def _value(q: Question, nats: float) -> float:
    needed = MIN_NATS_CONTESTED if q.kind == CONTESTED else MIN_NATS
    return q.weight * min(nats, DECISIVE_NATS) / DECISIVE_NATS if nats >= needed else 0.0


def _proposal(
    best: _RatedMotion, of_axis: Sequence[_RatedMotion], open_questions: Sequence[Question]
) -> NextExperiment:
    """Describe the best motion by the question for which it has the largest value."""
    first = max(range(len(open_questions)), key=lambda k: _value(open_questions[k], best.nats[k]))
    q = open_questions[first]
    motion = best.planned.motion
    ranked = sorted(of_axis, key=lambda one: -one.value_1_s)
    worst = min(of_axis, key=lambda one: one.nats[first])
    names = [name.removeprefix(PREFIX) for name in q.separates]
    also = [
        other.separates
        for k, other in enumerate(open_questions)
        if k != first and _value(other, best.nats[k]) > 0.0
    ]
    content = {
        "why": _why(q),
        "separates": names if q.kind != UNEXPLAINED else ["unknown", *names],
        "axis": best.axis,
        "motion": motion.words,
        "program": PROGRAM_FILE,
        "seconds": round(best.planned.seconds, 1),
        "evidence_nats": _three_digits(best.nats[first]),
        "instead": {"motion": worst.planned.motion.words, "evidence_nats": _three_digits(worst.nats[first])},
        "also": [" from ".join(name.removeprefix(PREFIX) for name in pair) for pair in also],
        "considered": [
            {
                "motion": one.planned.motion.words,
                "seconds": round(one.planned.seconds, 1),
                "evidence_nats": _three_digits(one.nats[first]),
            }
            for one in ranked[:LISTED_MOTIONS]
        ],
        "tells": _tells(q),
    }
    return NextExperiment(content, program_steps(best.axis, motion.steps), motion.kind, best.planned)


def _why(q: Question) -> str:
    names = [_display_name(name) for name in q.separates]
    if q.kind == HIDDEN:
        return f"{names[0]} of a size that machines have would hardly show in these recordings"
    if q.kind == UNEXPLAINED:
        return (
            f"what changes with the {names[0]} is explained by no entry of the catalogue, and {names[1]} "
            "would look alike here"
        )
    if q.kind == CONTESTED:
        return f"these recordings cannot tell {names[0]} from {names[1]}"
    return f"{names[0]} is often mistaken for {names[1]}, and these recordings hardly tell them apart"


def _tells(q: Question) -> str:
    if q.kind == UNEXPLAINED:
        coordinate, rival = map(_display_name, q.separates)
        return f"whether it changes with the {coordinate} or is {rival}"
    return distinguishing_observation(q.separates[0], q.separates[-1])


def _display_name(name: str) -> str:
    return name.removeprefix(PREFIX).replace("_", " ").replace("stribeck", "Stribeck")


def _three_digits(value: float) -> float:
    return float(f"{value:.3g}")
