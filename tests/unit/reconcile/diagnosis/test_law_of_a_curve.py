"""A curve of friction over the travel carries its law's name in the verdict; others stay without one."""

from typing import Any

import pytest

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import term
from reconcile.diagnosis.verdict import verdict
from reconcile.identification.explain import Explanation, ResidualRms
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.rivals import RivalEffect
from reconcile.regression.candidate_term import CandidateTerm

LAW = "position_dependent_friction"
FORCE, DEVIATION = ResidualChannel.FORCE, ResidualChannel.POSITION_DEVIATION


def test_the_sentence_of_an_unnamed_curve_says_after_its_first_colon_what_the_curve_shows() -> None:
    heights = dict.fromkeys(("at_1", "height_1", "at_2", "height_2"), 1.0)
    curve_term = term(PREFIX + "position")
    assert curve_term.sentence(heights).partition(": ")[2] == curve_term.finding(heights)


def curve(
    over: str, *, share: float = 0.4, own: bool = False, rival: tuple[str, float] | None = None
) -> IdentifiedEffect:
    """A curve; of the `rival` the name and what it explains, over what the curve does."""
    own_term = CandidateTerm(PREFIX + over, (0.0, 1.0, 9.0), own, (3, 4, 5))
    sentence = "something real that no entry explains: it changes with it, most at 0.2 m"
    rivals = [RivalEffect(rival[0], 0.0, rival[1])] if rival else []
    return IdentifiedEffect("unknown", "force", 0.97, [], rivals, [own_term], {}, 0.6, 0.5, sentence, share)


def named(effect: str) -> IdentifiedEffect:
    own_term = CandidateTerm(effect, (1.0,), False, (3,))
    return IdentifiedEffect(effect, "force", 0.9, [], [], [own_term], {}, 0.6, 0.5, "", 0.5)


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
    assert finding["explanation"].endswith("changes sign with direction: it changes with it, most at 0.2 m")


@pytest.mark.parametrize(
    ("over", "law"), [("speed_by_direction", "stribeck_friction"), ("position", "position_dependent_force")]
)
def test_a_curve_that_a_law_nearly_explains_bears_its_name(over: str, law: str) -> None:
    [finding] = verdict_of(curve(over, rival=(law, 0.94)))["findings"]
    assert (finding["effect"], finding["over"]) == (law, over)


@pytest.mark.parametrize(
    ("over", "rival"),
    [
        ("speed_by_direction", ("stribeck_friction", 0.8)),
        ("speed_by_direction", ("quadratic_viscous_friction", 0.95)),
        ("position", ("stribeck_friction", 0.95)),
        ("position", None),
    ],
    ids=["it explains too little", "another law", "the law of another coordinate", "no law"],
)
def test_a_curve_that_no_law_of_its_coordinate_nearly_explains_stays_unknown(
    over: str, rival: tuple[str, float] | None
) -> None:
    assert [f["effect"] for f in verdict_of(curve(over, rival=rival))["findings"]] == ["unknown"]


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
