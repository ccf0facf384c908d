"""Variants of the model that may be written in place of the identified effects.

A search on few recordings also finds what is particular to them. The model that is written is the one that
predicts left-out recordings best, and it must not lose to least squares with textbook friction. What a
variant adds is in the file only; it is not reported as a finding.
"""

from collections.abc import Callable, Mapping

import numpy as np

from reconcile.catalogue.asymmetric_viscous_friction import ENTRY as VISCOUS_BY_DIRECTION
from reconcile.catalogue.constant_force import ENTRY as CONSTANT_FORCE
from reconcile.catalogue.gravity import ENTRY as GRAVITY
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.catalogue.smooth_terms import COARSE_KNOTS, PREFIX, SMOOTH_TERMS
from reconcile.catalogue.stribeck_friction import ENTRY as STRIBECK
from reconcile.identification.explain import Explanation, with_terms, without
from reconcile.identification.term_search import FoundTerms
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.physical_veto import vetoed
from reconcile.regression.regression_problem import regression_problem

STRIBECK_SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Stribeck speeds that are tried, of the 95th percentile of the speed."""
FAST_PERCENTILE = 95.0
OVER_TRAVEL = "position"
"""The smooth term that a plant's table of force is."""
COLLINEAR_RIDGE = 1e-3
"""Ridge on the columns of textbook friction and weight: directions with less than a thirtieth of the
excitation are not fitted. With a tenth of this ridge a cobot's weight was predicted up to three times worse
in other motions. Calibrated on the measured machines kinova, kuka and bam."""

Variant = Callable[[Explanation, bool], Explanation]
"""Turns an explanation and `brief` (see `with_terms`) into the variant; unchanged where it does not apply."""


def as_found(explanation: Explanation, _brief: bool) -> Explanation:
    """The identified effects."""
    return explanation


def of_all_recordings(explanation: Explanation, brief: bool) -> Explanation:
    """The identified effects, refitted without the unnamed terms that each recording has of its own."""
    found = explanation.found
    own = {c.effect for c in found.terms if _is_own(c)} if found else set()
    return without(explanation, own, brief=brief)


def beside_textbook(explanation: Explanation, brief: bool) -> Explanation:
    """The identified effects and textbook friction."""
    found = explanation.found
    kept = [c for c in found.terms if not _is_own(c)] if found else []
    return _with_textbook(explanation, kept, brief=brief)


def textbook(explanation: Explanation, brief: bool) -> Explanation:
    """Textbook friction in place of the identified effects."""
    return _with_textbook(explanation, [], brief=brief)


def textbook_and_weight(explanation: Explanation, brief: bool) -> Explanation:
    """Textbook friction and, on a joint, the weight that it carries."""
    weight = _weight(explanation)
    return _with_textbook(explanation, [], weight, brief=brief) if weight else explanation


def textbook_and_table(explanation: Explanation, brief: bool) -> Explanation:
    """Textbook friction, the weight on a joint, and a table of force over the travel."""
    return _with_textbook(explanation, [], _weight(explanation) + _table(explanation), brief=brief)


AS_FOUND, OF_ALL_RECORDINGS = "as found", "fitted to all recordings"
BESIDE_TEXTBOOK, TEXTBOOK_ALONE = "beside textbook friction", "textbook friction"
WITH_WEIGHT, WITH_TABLE = "textbook friction and a weight", "textbook friction and a table over the travel"
VARIANTS: Mapping[str, Variant] = {
    AS_FOUND: as_found,
    OF_ALL_RECORDINGS: of_all_recordings,
    BESIDE_TEXTBOOK: beside_textbook,
    TEXTBOOK_ALONE: textbook,
    WITH_WEIGHT: textbook_and_weight,
    WITH_TABLE: textbook_and_table,
}
"""By the name in verdict.json; of those that predict alike the first is written."""
BETTER = "predicted what was left out better"
TEXTBOOK = "a constant force, viscous friction by direction and Stribeck friction, none of them a finding,"
NOTES = {
    OF_ALL_RECORDINGS: f"fitted without what one recording has of its own it {BETTER}",
    BESIDE_TEXTBOOK: f"with {TEXTBOOK} beside what was found it {BETTER}",
    TEXTBOOK_ALONE: f"with {TEXTBOOK} in place of what was found it {BETTER}",
    WITH_WEIGHT: f"with {TEXTBOOK} and a weight on the joint in place of what was found it {BETTER}",
    WITH_TABLE: f"with {TEXTBOOK} and a table over the travel in place of what was found it {BETTER}",
}
"""Note of the verdict on a variant that is written."""


def has_own(explanation: Explanation) -> bool:
    """Whether unnamed terms have coefficients of their own in each recording."""
    return explanation.found is not None and any(_is_own(c) for c in explanation.found.terms)


def variants_of(explanation: Explanation) -> Mapping[str, Variant]:
    """The variants to compare with the identified effects; none where the residual is noise.

    Nor where a named effect has its own phase in each recording, which no left-out recording can test. Forces
    over the position are compared only with several recordings: the last third of a motion covers the same
    positions as the rest of it.
    """
    found = explanation.found
    if found is not None and any(c.per_recording and not _is_own(c) for c in found.terms):
        return {}
    is_force = explanation.channel is ResidualChannel.FORCE
    sizes = explanation.accounted
    if found is None or not is_force or sizes is None or sizes.is_noise:
        return {}
    over_position = () if len(found.problem.datasets) > 1 else (WITH_WEIGHT, WITH_TABLE)
    return {name: of for name, of in VARIANTS.items() if of is not as_found and name not in over_position}


def _is_own(candidate: CandidateTerm) -> bool:
    return candidate.per_recording and candidate.effect.startswith(PREFIX)


Shapes = list[tuple[str, ShapeParameters]]
"""Effects, each with its shape parameters."""


def _weight(explanation: Explanation) -> Shapes:
    """The weight on a joint; none on a linear axis, or where the joint hardly turns."""
    found = explanation.found
    return [(GRAVITY.name, s) for s in GRAVITY.terms[0].shapes(found.problem.datasets)] if found else []


def _table(explanation: Explanation) -> Shapes:
    """A coarse table of force over the travel."""
    found = explanation.found
    shapes = SMOOTH_TERMS[OVER_TRAVEL].shapes(found.problem.datasets) if found else []
    return [(PREFIX + OVER_TRAVEL, shape) for shape in shapes if shape[2] == COARSE_KNOTS]


def _with_textbook(
    explanation: Explanation, kept: list[CandidateTerm], beside: Shapes | None = None, *, brief: bool
) -> Explanation:
    """`kept` terms with a constant force, viscous friction by direction, Stribeck friction and `beside`.

    Those that the model has already, or that are physically impossible beside the others, are left out.
    """
    found = explanation.found
    if found is None:
        return explanation
    known = {*(c.effect for c in kept), *found.inputs.axis.model_effects.effects}
    textbook_shapes = [(entry.name, ()) for entry in (CONSTANT_FORCE, VISCOUS_BY_DIRECTION)]
    more = [(name, shape) for name, shape in [*textbook_shapes, *(beside or [])] if name not in known]
    best: tuple[float, FoundTerms] | None = None
    for shape in _stribeck_shapes(found) if STRIBECK.name not in known else [None]:
        fitted = _possible(found, kept, more, shape)
        equations = fitted.problem.equations
        slots = equations.slots(fitted.terms)
        theta = equations.solve(slots, equations.totals(found.train))
        squares = float(equations.squares(slots, theta, found.train).sum())
        if best is None or squares < best[0]:
            best = squares, fitted
    if best is None or [c.key for c in best[1].terms] == [c.key for c in found.terms]:
        return explanation
    made = with_terms(explanation, best[1], brief=brief)
    own = {f.effect for f in explanation.findings}
    unreported = [f for f in made.findings if f.effect not in own and (f.candidates or f.effect != "unknown")]
    findings = [f for f in made.findings if f not in unreported]
    return made._replace(findings=findings, minor=[*made.minor, *unreported])


def _possible(
    found: FoundTerms, kept: list[CandidateTerm], more: Shapes, stribeck: ShapeParameters | None
) -> FoundTerms:
    """The terms fitted together, without physically impossible ones among the added."""
    added = list(more)
    if stribeck is not None:
        added.append((STRIBECK.name, stribeck))
    problem = found.problem
    wide = regression_problem(
        problem.datasets,
        problem.channel,
        [*((c.effect, c.shape_parameters) for c in kept), *added],
        only=True,
        model_terms=problem.model_terms,
    )
    equations = wide.equations.with_ridge(COLLINEAR_RIDGE)
    wide = wide._replace(equations=equations)
    own = equations.by_key
    terms = [own[c.key] for c in kept] + [own[name, shape, False] for name, shape in added]
    while True:
        slots = equations.slots(terms)
        weights = equations.denormalised(slots, equations.solve(slots, equations.totals(found.train)))
        refused = {*vetoed(wide, terms, weights, found.inputs.axis)} & {name for name, _ in added}
        if not refused:
            break
        terms = [c for c in terms if c.effect not in refused]
    rivals = {**found.rivals, **{name: (0.0, []) for name, _ in added}}
    return found._replace(problem=wide, terms=terms, rivals=rivals)


def _stribeck_shapes(found: FoundTerms) -> list[ShapeParameters]:
    speeds = [
        np.abs(data.motion.velocity_m_s[used])
        for data, used in zip(found.problem.datasets, found.problem.used, strict=True)
    ]
    fast_m_s = float(np.percentile(np.concatenate(speeds), FAST_PERCENTILE))
    return [(share * fast_m_s,) for share in STRIBECK_SHARES] if fast_m_s > 0.0 else []
