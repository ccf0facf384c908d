"""Variants of the model that may be written in place of the identified effects.

A search on few recordings also fits what is particular to them. The model that is written is the one that
predicts left-out recordings best, so least squares with textbook friction must be among the variants. What
a variant adds is in the file only; it is not reported as a finding.
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
from reconcile.identification.selected_terms import SelectedTerms
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.physical_veto import vetoed
from reconcile.regression.regression_problem import regression_problem

STRIBECK_SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Stribeck speeds that are tried, as shares of the FAST_PERCENTILE of the speed; chosen."""
FAST_PERCENTILE = 95.0
TABLE_COORDINATE = "position"
"""Coordinate of the smooth term that a plant file holds as a table of force."""
COLLINEAR_RIDGE = 1e-3
"""Ridge on the columns of textbook friction and weight: directions with less than a thirtieth of the
excitation are not fitted. With a tenth of this ridge a cobot's weight was predicted up to three times worse
in other motions. Calibrated on the measured machines kinova, kuka and bam."""

Variant = Callable[[Explanation, bool], Explanation]
"""Takes an explanation and `parameters_only` (see `with_terms`); unchanged if it does not apply."""


def as_found(explanation: Explanation, _parameters_only: bool) -> Explanation:
    """The identified effects."""
    return explanation


def of_all_recordings(explanation: Explanation, parameters_only: bool) -> Explanation:
    """The identified effects, refitted without the unnamed terms that each recording has of its own."""
    selected = explanation.selected
    unnamed = {c.effect for c in selected.terms if _is_unnamed_per_recording(c)} if selected else set()
    return without(explanation, unnamed, parameters_only=parameters_only)


def beside_textbook(explanation: Explanation, parameters_only: bool) -> Explanation:
    """The identified effects and textbook friction."""
    selected = explanation.selected
    kept = [c for c in selected.terms if not _is_unnamed_per_recording(c)] if selected else []
    return _with_textbook(explanation, kept, parameters_only=parameters_only)


def textbook(explanation: Explanation, parameters_only: bool) -> Explanation:
    """Textbook friction in place of the identified effects."""
    return _with_textbook(explanation, [], parameters_only=parameters_only)


def textbook_and_weight(explanation: Explanation, parameters_only: bool) -> Explanation:
    """Textbook friction and, on a joint, the weight that it carries."""
    weight = _weight_shapes(explanation)
    return _with_textbook(explanation, [], weight, parameters_only=parameters_only) if weight else explanation


def textbook_and_table(explanation: Explanation, parameters_only: bool) -> Explanation:
    """Textbook friction, the weight on a joint, and a table of force over the travel."""
    shapes = _weight_shapes(explanation) + _table_shapes(explanation)
    return _with_textbook(explanation, [], shapes, parameters_only=parameters_only)


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
OVER_POSITION = frozenset({WITH_WEIGHT, WITH_TABLE})
"""Variants with a force over the position that was not identified. It may be that of one pose or load, so it
must hold from one recording to the next by more than the scatter of their errors."""
PREDICTED_BETTER = "predicted what was left out better"
TEXTBOOK_FRICTION = (
    "a constant force, viscous friction by direction and Stribeck friction, none of them a finding,"
)
NOTES = {
    OF_ALL_RECORDINGS: f"fitted without what one recording has of its own it {PREDICTED_BETTER}",
    BESIDE_TEXTBOOK: f"with {TEXTBOOK_FRICTION} beside what was found it {PREDICTED_BETTER}",
    TEXTBOOK_ALONE: f"with {TEXTBOOK_FRICTION} in place of what was found it {PREDICTED_BETTER}",
    WITH_WEIGHT: (
        f"with {TEXTBOOK_FRICTION} and a weight on the joint in place of what was found it {PREDICTED_BETTER}"
    ),
    WITH_TABLE: (
        f"with {TEXTBOOK_FRICTION} and a table over the travel in place of what was found it "
        f"{PREDICTED_BETTER}"
    ),
}
"""Note of the verdict on a variant that is written."""


def has_unnamed_per_recording(explanation: Explanation) -> bool:
    """Whether unnamed terms have coefficients of their own in each recording."""
    return explanation.selected is not None and any(
        map(_is_unnamed_per_recording, explanation.selected.terms)
    )


def variants_of(explanation: Explanation) -> Mapping[str, Variant]:
    """The variants to compare with the identified effects, by name.

    None where the residual is noise, nor where a named effect has its own phase in each recording, which no
    left-out recording can test. Forces over the position are compared only with several recordings: the last
    third of a motion covers the same positions as the first two.
    """
    selected = explanation.selected
    if selected is not None and any(
        c.per_recording and not _is_unnamed_per_recording(c) for c in selected.terms
    ):
        return {}
    is_force = explanation.channel is ResidualChannel.FORCE
    sizes = explanation.accounted
    if selected is None or not is_force or sizes is None or sizes.is_noise:
        return {}
    omitted = {AS_FOUND}
    if len(selected.problem.datasets) == 1:
        omitted |= OVER_POSITION
    return {name: variant for name, variant in VARIANTS.items() if name not in omitted}


def _is_unnamed_per_recording(term: CandidateTerm) -> bool:
    return term.per_recording and term.effect.startswith(PREFIX)


TermShapes = list[tuple[str, ShapeParameters]]
"""Effects, each with its shape parameters."""


def _weight_shapes(explanation: Explanation) -> TermShapes:
    """The weight on a joint; none on a linear axis, or where the joint hardly turns."""
    selected = explanation.selected
    shapes = GRAVITY.terms[0].shapes(selected.problem.datasets) if selected else []
    return [(GRAVITY.name, shape) for shape in shapes]


def _table_shapes(explanation: Explanation) -> TermShapes:
    """A coarse table of force over the travel."""
    selected = explanation.selected
    shapes = SMOOTH_TERMS[TABLE_COORDINATE].shapes(selected.problem.datasets) if selected else []
    return [(PREFIX + TABLE_COORDINATE, shape) for shape in shapes if shape[2] == COARSE_KNOTS]


def _with_textbook(
    explanation: Explanation,
    kept: list[CandidateTerm],
    further: TermShapes | None = None,
    *,
    parameters_only: bool,
) -> Explanation:
    """`kept` terms with a constant force, viscous friction by direction, Stribeck friction and `further`.

    Those that the model has already, or that are physically impossible beside the others, are omitted.
    """
    selected = explanation.selected
    if selected is None:
        return explanation
    present = {*(c.effect for c in kept), *selected.inputs.axis.model_effects.effects}
    textbook_shapes = [(entry.name, ()) for entry in (CONSTANT_FORCE, VISCOUS_BY_DIRECTION)]
    added = [(name, shape) for name, shape in [*textbook_shapes, *(further or [])] if name not in present]
    with_stribeck = [added]
    if STRIBECK.name not in present:
        with_stribeck = [[*added, (STRIBECK.name, shape)] for shape in _stribeck_shapes(selected)]
    fits = (_fit_possible(selected, kept, shapes) for shapes in with_stribeck)  # two at a time in memory
    best = min(fits, key=_training_squares, default=None)
    if best is None or [c.key for c in best.terms] == [c.key for c in selected.terms]:
        return explanation
    return with_terms(explanation, best, parameters_only=parameters_only)


def _training_squares(selected: SelectedTerms) -> float:
    equations = selected.problem.equations
    slots = equations.slots(selected.terms)
    theta = equations.solve(slots, equations.totals(selected.train))
    return float(equations.squares(slots, theta, selected.train).sum())


def _fit_possible(selected: SelectedTerms, kept: list[CandidateTerm], added: TermShapes) -> SelectedTerms:
    """The `kept` and `added` terms fitted together, without added ones that are physically impossible."""
    problem = regression_problem(
        selected.problem.datasets,
        selected.problem.channel,
        [*((c.effect, c.shape_parameters) for c in kept), *added],
        only=True,
        model_terms=selected.problem.model_terms,
    )
    equations = problem.equations.with_ridge(COLLINEAR_RIDGE)
    problem = problem._replace(equations=equations)
    by_key = equations.by_key
    terms = [by_key[c.key] for c in kept] + [by_key[name, shape, False] for name, shape in added]
    while True:
        slots = equations.slots(terms)
        weights = equations.denormalised(slots, equations.solve(slots, equations.totals(selected.train)))
        # the ridge shares a force equally among columns that nothing tells apart: of a motion in one
        # direction half is Coulomb friction and half a constant force, which errs least in the other one
        refused = vetoed(problem, terms, weights, selected.inputs.axis, to_be_named=False)
        impossible = {*refused} & {name for name, _ in added}
        if not impossible:
            break
        terms = [c for c in terms if c.effect not in impossible]
    rivals = {**selected.rivals, **{name: (0.0, []) for name, _ in added}}
    return selected._replace(problem=problem, terms=terms, rivals=rivals)


def _stribeck_shapes(selected: SelectedTerms) -> list[ShapeParameters]:
    speeds_m_s = [
        np.abs(data.motion.velocity_m_s[used])
        for data, used in zip(selected.problem.datasets, selected.problem.used, strict=True)
    ]
    fast_m_s = float(np.percentile(np.concatenate(speeds_m_s), FAST_PERCENTILE))
    return [(share * fast_m_s,) for share in STRIBECK_SHARES] if fast_m_s > 0.0 else []
