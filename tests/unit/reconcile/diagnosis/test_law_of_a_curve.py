"""A curve of friction over the travel carries its law's name in the verdict; others stay without one."""

from typing import Any

import pytest

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.diagnosis.verdict import verdict
from reconcile.identification.explain import Explanation, ResidualRms
from reconcile.identification.findings import IdentifiedEffect
from reconcile.regression.candidate_term import CandidateTerm

LAW = "position_dependent_friction"
FORCE, DEVIATION = ResidualChannel.FORCE, ResidualChannel.POSITION_DEVIATION


def curve(over: str, *, share: float = 0.4, own: bool = False) -> IdentifiedEffect:
    term = CandidateTerm(PREFIX + over, (0.0, 1.0, 9.0), own, (3, 4, 5))
    said = "it changes with it, most at 0.2 m"
    return IdentifiedEffect("unknown", "force", 0.97, [], [], [term], {}, 0.6, 0.5, said, share)


def named(effect: str) -> IdentifiedEffect:
    term = CandidateTerm(effect, (1.0,), False, (3,))
    return IdentifiedEffect(effect, "force", 0.9, [], [], [term], {}, 0.6, 0.5, "", 0.5)


def verdict_of(*findings: IdentifiedEffect, channel: ResidualChannel = FORCE) -> dict[str, Any]:
    size = ResidualRms(1.0, 1.0)
    one = Explanation(channel, [*findings], [], size, size, size, {}, None, 0.0, False, [])
    return verdict({"x": [one]}, [])


def test_friction_over_the_travel_is_named_and_keeps_its_curve() -> None:
    content = verdict_of(curve("position_by_direction"))
    [finding] = content["findings"]
    assert (content["verdict"], finding["effect"], finding["over"]) == (
        "effects",
        LAW,
        "position_by_direction",
    )
    assert "changes sign with direction" in finding["explanation"]


@pytest.mark.parametrize(
    ("findings", "channel"),
    [
        ([curve("position_of_the_mass")], FORCE),
        ([curve("position_by_direction")], DEVIATION),
        ([curve("position_by_direction", share=-0.2)], FORCE),
        ([curve("position_by_direction", own=True)], FORCE),
    ],
    ids=["another coordinate", "the scale less the motor", "only beside other terms", "of each recording"],
)
def test_what_is_no_friction_of_the_travel_stays_unknown(
    findings: list[IdentifiedEffect], channel: ResidualChannel
) -> None:
    assert [f["effect"] for f in verdict_of(*findings, channel=channel)["findings"]] == ["unknown"]


def test_beside_the_named_law_a_curve_is_what_it_leaves() -> None:
    content = verdict_of(named(LAW), curve("position_by_direction"))
    assert [f["effect"] for f in content["findings"]] == [LAW, "unknown"]
