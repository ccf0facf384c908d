"""The motion that would tell what the recordings could not: the one with the most evidence to be expected.

What is open are pairs of models (`next_experiment_questions`): names that are contested, names that are often
mistaken for one another, what no entry explains, and what may be there unseen. Each motion of the pool is
weighed on all of them (`expected_evidence`); what is worth most a second of machine time is asked for. Where
no motion tells, a sensor or a hand may.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.expected_evidence import Sized, Weighing
from reconcile.held_presliding import KERNELS
from reconcile.model_effects import model_effects
from reconcile.next_experiment_by_hand import by_hand
from reconcile.next_experiment_limits import limits_seen
from reconcile.next_experiment_pool import pool
from reconcile.next_experiment_program import PROGRAM, program_steps
from reconcile.next_experiment_questions import CONTESTED, HIDDEN, UNEXPLAINED, questions
from reconcile.next_experiment_recorded import recorded
from reconcile.next_experiment_rules import told_apart
from reconcile.next_experiment_scene import scene_to_come
from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from reconcile.explain import Explanation
    from reconcile.model_file import NominalAxis
    from reconcile.next_experiment_limits import Limits
    from reconcile.next_experiment_pool import Planned
    from reconcile.next_experiment_questions import Question
    from reconcile.next_experiment_recorded import Recorded

ENOUGH = 100.0
"""Nats: more decide nothing more. Columns are not the truth: a hundred are asked for where ten would do."""
NEEDED = 20.0
"""Nats: a motion that tells less is not worth making."""
NEEDED_CONTESTED = 3.0
"""The same for a name that is in doubt already: odds of twenty to one."""
UNNOTICED = 5.0
"""Nats that something may hold in the recordings without having been named."""
OVERHEAD_S = 10.0
"""Of each recording: referencing, starting, reading it."""
PERIOD_S = 2e-3
"""Of the motions that are weighed: the filter passes no more."""
STALE = 0.5
"""What a kind of motion did not decide it will hardly decide the next time."""
SLOWEST, SHOWN = 3.0, 6
"""Creep speeds that are seen as motion; motions that a verdict lists."""


class Asked(NamedTuple):
    """What to do next."""

    content: dict[str, Any]
    """`next_experiment` of verdict.json; empty where nothing is open."""
    program: list[dict[str, Any]]
    """Steps of a program file; empty where it is no motion."""
    kind: str
    """Of the motion."""
    planned: Planned | None


class _Weighed(NamedTuple):
    """One motion of one axis on all questions."""

    axis: str
    planned: Planned
    nats: list[float]
    worth_1_s: float


NOTHING = Asked({}, [], "", None)


def next_experiment(
    explanations: Mapping[str, Sequence[Explanation]],
    axes: Mapping[str, NominalAxis],
    limits: Mapping[str, Limits] | None = None,
    made: Sequence[str] = (),
) -> Asked:
    """The best motion over all axes, within `limits` or else within what the recordings show.

    `made`: kinds of motions that were asked for before.
    """
    asked: dict[str, list[Question]] = {}
    weighed: list[_Weighed] = []
    known = {name: recorded(own, axes[name]) for name, own in explanations.items() if own}
    for name, seen in known.items():
        within = (limits or {}).get(name) or limits_seen(seen)
        asked[name], of_axis = _weigh(name, explanations[name], axes[name], seen, within, made)
        weighed += of_axis
    best = max(weighed, key=lambda one: one.worth_1_s, default=None)
    if best is None or best.worth_1_s <= 0.0:
        first = by_hand(known, explanations)
        return Asked(first, [], "", None) if first else NOTHING
    return _asked(best, [one for one in weighed if one.axis == best.axis], asked[best.axis])


def _weigh(
    name: str,
    of_axis: Sequence[Explanation],
    axis: NominalAxis,
    seen: Recorded,
    within: Limits,
    made: Sequence[str],
) -> tuple[list[Question], list[_Weighed]]:
    like = of_axis[0].rests[0].scene
    period_s = max(like.period_s, PERIOD_S)
    motions = pool(within, period_s, SLOWEST * seen.creep_m_s, seen.finest_m)
    scenes = [scene_to_come(one.position_m, period_s, like, seen) for one in motions]
    every: list[Question] = []
    nats: list[list[float]] = [[] for _ in motions]
    for explanation in of_axis:
        own = questions(explanation, seen)
        terms = [term for q in own for option in (*q.truths, *q.rivals, q.beside) for term in option]
        terms += [q.sized.term for q in own if q.sized is not None]
        recordings = [rest.scene for rest in explanation.rests]
        held = [
            one
            for one in model_effects(axis.held, axis, recordings)
            if one.sense is explanation.sense
            and not (
                one.effect == "presliding_hysteresis" and not KERNELS.keys().isdisjoint(axis.held.effects)
            )
        ]
        weighing = Weighing(explanation.rests, explanation.sense, held, terms)
        own = [sized for q in own for sized in _open(weighing, q)]
        for found, scene in zip(nats, scenes, strict=True):
            products = weighing.products(scene)
            for q in own:
                if q.sized is not None:
                    both = weighing.hidden(q.sized, q.beside, products)
                    found.append(max(both - weighing.hidden(q.sized, q.beside, None), 0.0))
                else:
                    there = weighing.gained(q.truths, q.rivals, products)
                    found.append(0.5 * (there + weighing.gained(q.rivals, q.truths, products)))
        every += own
    return every, [
        _Weighed(name, one, found, _worth(every, found, one, made))
        for one, found in zip(motions, nats, strict=True)
    ]


def _open(weighing: Weighing, q: Question) -> list[Question]:
    """The question if the recordings have not answered it; what is unseen no larger than it can be."""
    if q.sized is not None:
        if weighing.columns(q.sized.term) == 0:
            return []
        here = weighing.columns(q.sized.term)
        sized = q.sized._replace(coefficients=(*q.sized.coefficients, 0.0, 0.0)[:here])
        shown = weighing.hidden(sized, q.beside, None)
        size = min(1.0, (UNNOTICED / shown) ** 0.5) if shown > 0.0 else 1.0
        return [q._replace(sized=Sized(sized.term, tuple(size * c for c in sized.coefficients)))]
    rivals = tuple(option for option in q.rivals if weighing.columns(option[-1]))
    truths = tuple(option for option in q.truths if all(weighing.columns(term) for term in option))
    if not (rivals and truths):
        return []
    there = 0.5 * (weighing.recorded(truths, rivals) + weighing.recorded(rivals, truths))
    return [] if there >= NEEDED and q.kind != CONTESTED else [q._replace(rivals=rivals, truths=truths)]


def _worth(every: Sequence[Question], nats: Sequence[float], one: Planned, made: Sequence[str]) -> float:
    """Expected evidence a second, each question's up to what is enough."""
    told = sum(_value(q, found) for q, found in zip(every, nats, strict=True))
    return STALE ** made.count(one.motion.kind) * told / (one.seconds + OVERHEAD_S)


def _value(q: Question, nats: float) -> float:
    needed = NEEDED_CONTESTED if q.kind == CONTESTED else NEEDED
    return q.weight * min(nats, ENOUGH) / ENOUGH if nats >= needed else 0.0


def _asked(best: _Weighed, all_of_axis: Sequence[_Weighed], every: Sequence[Question]) -> Asked:
    first = max(range(len(every)), key=lambda k: _value(every[k], best.nats[k]))
    q = every[first]
    motion = best.planned.motion
    ranked = sorted(all_of_axis, key=lambda one: -one.worth_1_s)
    least = min(all_of_axis, key=lambda one: one.nats[first])
    names = [name.removeprefix(PREFIX) for name in q.separates]
    more = [
        every[k].separates for k in range(len(every)) if k != first and _value(every[k], best.nats[k]) > 0.0
    ]
    content = {
        "why": _why(q),
        "separates": names if q.kind != UNEXPLAINED else ["unknown", *names],
        "axis": best.axis,
        "motion": motion.words,
        "program": PROGRAM,
        "seconds": round(best.planned.seconds, 1),
        "evidence_nats": _digits(best.nats[first]),
        "instead": {"motion": least.planned.motion.words, "evidence_nats": _digits(least.nats[first])},
        "also": [" from ".join(name.removeprefix(PREFIX) for name in pair) for pair in more],
        "considered": [
            {
                "motion": one.planned.motion.words,
                "seconds": round(one.planned.seconds, 1),
                "evidence_nats": _digits(one.nats[first]),
            }
            for one in ranked[:SHOWN]
        ],
        "tells": _tells(q),
    }
    return Asked(content, program_steps(best.axis, motion.steps), motion.kind, best.planned)


def _why(q: Question) -> str:
    names = [_words(name) for name in q.separates]
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
        return f"whether it changes with the {_words(q.separates[0])} or is {_words(q.separates[1])}"
    return told_apart(q.separates[0], q.separates[-1])


def _words(name: str) -> str:
    return name.removeprefix(PREFIX).replace("_", " ").replace("stribeck", "Stribeck")


def _digits(value: float) -> float:
    return float(f"{value:.3g}")
