"""No entry of the catalogue is named for a force, or a deviation, that has nothing to do with it.

Entries are found by the registry, so that a new one is held to it too. What an entry alone would accept by
chance is not a name: a name must also predict blocks that took no part in anything.
"""

import pytest
from unrelated_forces import EMPS, UNRELATED, recorded

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import ENTRIES, family
from reconcile.catalogue.unnamed_terms import term
from reconcile.diagnosis.axis_diagnosis import DEVIATION_LEAST_GAIN
from reconcile.identification.findings import report_findings
from reconcile.identification.held_out_blocks import training_and_held_out
from reconcile.identification.rivals import compare_rivals
from reconcile.regression.candidate_term import effect_names
from reconcile.regression.regression_problem import SINCE_REVERSAL, regression_problem
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.stepwise_selection import select

SEEDS = (0, 1, 2)
RULES = {
    ResidualChannel.FORCE: SelectionRules(),
    ResidualChannel.POSITION_DEVIATION: SelectionRules(least_gain=DEVIATION_LEAST_GAIN),
}
FAMILIES = [(effect, channel) for effect in ENTRIES for channel in ResidualChannel if family(effect, channel)]
SHAPED_BY_WHAT_IS_THERE = {"voltage_saturation", "periodic_disturbance", "drive_compliance"}
"""Entries whose shapes are read off the force: without the effect there may be none to try."""

OF_ROTARY_AXES = {"gravity", "gravity_of_outer_link", "joint_coupling"}


def named(effect: str, channel: ResidualChannel, kind: str, seed: int) -> list[str]:
    """What is reported where the entry is the only one there is."""
    datasets = recorded(kind, seed, rotary=effect in OF_ROTARY_AXES)
    of = family(effect, channel)
    assert of is not None
    shapes = of.shapes(datasets)
    assert shapes or effect in SHAPED_BY_WHAT_IS_THERE
    tried = [(effect, shape) for shape in shapes]
    tried += [(SINCE_REVERSAL, shape) for shape in term(SINCE_REVERSAL).shapes(datasets)]
    problem = regression_problem(datasets, channel, tried, only=True)
    train, held_out = training_and_held_out(problem)
    validation = CrossValidation(problem.equations, train)
    chosen = select(validation, RULES[channel])
    rivals = {name: compare_rivals(validation, chosen, name) for name in effect_names(chosen)}
    return [f.effect for f in report_findings(problem, chosen, rivals, train, held_out).findings]


@pytest.mark.parametrize("kind", UNRELATED)
@pytest.mark.parametrize(("effect", "channel"), FAMILIES, ids=[f"{e}-{c.value}" for e, c in FAMILIES])
def test_no_effect_is_named_for_what_is_unrelated(effect: str, channel: ResidualChannel, kind: str) -> None:
    if kind.startswith("shuffled") and not EMPS.exists():
        pytest.skip("../shared/data/emps is absent")
    for seed in SEEDS:
        assert named(effect, channel, kind, seed) == [], seed
