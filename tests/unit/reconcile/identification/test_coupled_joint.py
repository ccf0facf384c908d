"""Two joints of a robot that move each other are named, with the values of the links; others are not."""

import math

import numpy as np
import pytest
from double_pendulum import ARM, INERTIA_2, INNER_WEIGHT, MASSES, OUTER_WEIGHT, recordings
from known_axis import AXIS

from reconcile.catalogue.gravity import ENTRY as GRAVITY
from reconcile.catalogue.gravity_of_outer_link import ENTRY as OUTER
from reconcile.catalogue.joint_coupling import ENTRY as COUPLING
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.coupled_joint import beside_coupled_joint
from reconcile.identification.explain import Explanation, explain
from reconcile.identification.held_out_blocks import training_and_held_out
from reconcile.identification.parameter_estimates import Estimate
from reconcile.identification.term_search import TermSearch
from reconcile.recording.kinematics import Kinematics, kinematics
from reconcile.recording.recording import AxisRecording
from reconcile.regression import regression_data
from reconcile.regression.noisy_acceleration import LOWERED_CORNERS_HZ, motion_of
from reconcile.regression.regression_data import low_pass_of
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.selection.selection_rules import SelectionRules

COARSE_RAD = 2e-3
"""Count of an encoder of 3100 lines a turn: its noise needs as much torque as the motion."""


def search_of(joint: str, *, seed: int = 5, coupled: bool = True, count_rad: float = 1e-5) -> TermSearch:
    axis = AXIS._replace(rotary=True, mass_kg=MASSES[joint], lead_m=2.0 * math.pi)
    recorded = [recordings(seed + k, coupled=coupled, count_rad=count_rad)[joint] for k in range(2)]
    return TermSearch(recorded, axis, ResidualChannel.FORCE, SelectionRules())


def explained(joint: str, *, coupled: bool = True, count_rad: float = 1e-5) -> Explanation:
    return explain(search_of(joint, coupled=coupled, count_rad=count_rad))


def unexplained_n_m(problem: RegressionProblem) -> float:
    """Low-passed torque that the model leaves, RMS: lines of its spectrum are candidates."""
    data = problem.datasets[0]
    left_n_m = low_pass_of(data)(data.force_n - data.model_force_n)
    return float(np.std(left_n_m[problem.used[0]]))


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


def test_candidates_are_read_off_a_torque_without_the_coupling() -> None:
    scanned = search_of("j1").problem
    beside, joint = beside_coupled_joint(scanned, training_and_held_out(scanned)[0], 0)
    assert {effect for effect, *_ in joint} >= {"joint_coupling", "gravity_of_outer_link"}
    assert unexplained_n_m(beside) < 0.1 * unexplained_n_m(scanned)


def test_without_a_coupling_candidates_are_read_once() -> None:
    scanned = search_of("j1", coupled=False).problem
    assert beside_coupled_joint(scanned, training_and_held_out(scanned)[0], 0) == (scanned, [])


def test_behind_a_low_pass_the_forces_of_coupled_joints_cancel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is filtered as often as the torque: a joint that swings freely has large forces and no torque."""

    def low_passed(recording: AxisRecording, _nominal_kg: float) -> Kinematics:
        return kinematics(recording.motor_m, recording.period_s, LOWERED_CORNERS_HZ[-1])

    monkeypatch.setattr(regression_data, "motion_of", low_passed)
    problem = search_of("j1").problem
    data, used = problem.datasets[0], problem.used[0]
    low_pass = low_pass_of(data)
    torque, rigid = regression_data.target_and_baseline(data, ResidualChannel.FORCE)
    terms = [(COUPLING, (0.0, 0.0)), (OUTER, (0.0, 1.0)), (GRAVITY, (1.0,))]
    columns = [low_pass(entry.terms[0].columns(data, shape)) for entry, shape in terms]
    x, y = np.concatenate((rigid, *columns), axis=1)[used], torque[used]
    theta, *_ = np.linalg.lstsq(x, y, rcond=None)
    assert np.std(y - x @ theta) < 0.005 * np.std(y)
    assert theta[[0, 3, 4]] == pytest.approx([MASSES["j1"], INERTIA_2, ARM], rel=0.01)
