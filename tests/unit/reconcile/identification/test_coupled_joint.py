"""Two joints of a robot that move each other are named, with the values of the links; others are not."""

import math

import pytest
from double_pendulum import ARM, INERTIA_2, INNER_WEIGHT, MASSES, OUTER_WEIGHT, recordings
from known_axis import AXIS

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.explain import Explanation, explain
from reconcile.identification.parameter_estimates import Estimate
from reconcile.identification.term_search import TermSearch
from reconcile.regression.noisy_acceleration import motion_of
from reconcile.selection.selection_rules import SelectionRules

COARSE_RAD = 2e-3
"""Count of an encoder of 3100 lines a turn: its noise needs as much torque as the motion."""


def explained(joint: str, *, seed: int = 5, coupled: bool = True, count_rad: float = 1e-5) -> Explanation:
    axis = AXIS._replace(rotary=True, mass_kg=MASSES[joint], lead_m=2.0 * math.pi)
    recorded = [recordings(seed + k, coupled=coupled, count_rad=count_rad)[joint] for k in range(2)]
    return explain(TermSearch(recorded, axis, ResidualChannel.FORCE, SelectionRules()))


def found(explanation: Explanation) -> dict[str, dict[str, Estimate]]:
    return {f.effect: f.parameters for f in explanation.findings}


@pytest.mark.parametrize(("joint", "outer"), [("j1", 0.0), ("j2", 1.0)])
def test_the_coupling_of_two_joints_is_named_with_the_links_values(joint: str, outer: float) -> None:
    explanation = explained(joint)
    effects = found(explanation)
    coupling, weight = effects["joint_coupling"], effects["gravity_of_outer_link"]
    assert coupling["outer"].value == outer
    assert coupling["inertia_kg"].value == pytest.approx(INERTIA_2, rel=0.05)
    assert coupling["arm_kg"].value == pytest.approx(ARM, rel=0.05)
    assert math.cos(coupling["phase_rad"].value) > 0.99
    assert weight["amplitude_n"].value == pytest.approx(OUTER_WEIGHT, rel=0.05)
    assert explanation.base["mass_kg"] == pytest.approx(MASSES[joint], rel=0.05)
    assert set(effects) <= {"joint_coupling", "gravity_of_outer_link", "gravity", "presliding_hysteresis"}
    if joint == "j1":
        assert effects["gravity"]["amplitude_n"].value == pytest.approx(INNER_WEIGHT, rel=0.05)


@pytest.mark.parametrize("joint", ["j1", "j2"])
def test_joints_that_do_not_move_each_other_are_not_coupled(joint: str) -> None:
    effects = found(explained(joint, coupled=False))
    assert "gravity" in effects
    assert not {"joint_coupling", "gravity_of_outer_link"} & effects.keys()


def test_a_coarse_encoder_hides_the_mass_only_above_the_corner() -> None:
    """By itself the outer joint shows another mass: what the inner one needs hides it."""
    fine, coarse = (
        motion_of(recordings(5, count_rad=count)["j2"], MASSES["j2"]) for count in (1e-6, COARSE_RAD)
    )
    assert coarse.corner_hz <= 30.0 < fine.corner_hz
    coupling = found(explained("j2", count_rad=COARSE_RAD))["joint_coupling"]
    assert coupling["inertia_kg"].value == pytest.approx(INERTIA_2, rel=0.1)
