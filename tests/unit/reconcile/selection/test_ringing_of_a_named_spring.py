"""An unnamed ringing at the antiresonance of a named spring is the same load, and is not a term beside it."""

import pytest

from reconcile.catalogue.relaxation_terms import RINGING_EFFECT
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.selection.unnamed_selection import is_of_spring


@pytest.mark.parametrize(("ringing_hz", "alike"), [(50.0, True), (65.0, True), (20.0, False)])
def test_only_near_the_antiresonance(ringing_hz: float, alike: bool) -> None:
    ringing = CandidateTerm(RINGING_EFFECT, (ringing_hz,), False, (3, 4))
    assert is_of_spring(ringing, CandidateTerm("drive_compliance", (54.0, 0.03), False, (5,))) is alike
    assert not is_of_spring(ringing, CandidateTerm("cogging", (54.0,), False, (5,)))
    assert not is_of_spring(ringing, CandidateTerm("drive_compliance", (), False, (5,)))
