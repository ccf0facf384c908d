"""Presliding, Stribeck friction and ripples of a joint are sought over its own angles, speeds and turns."""

import numpy as np
import pytest
from known_axis import AXIS

from kernels.arrays import Array
from reconcile.catalogue.cogging import ENTRY as COGGING
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.presliding_hysteresis import ENTRY as PRESLIDING
from reconcile.catalogue.registry import ENTRIES
from reconcile.catalogue.stribeck_friction import ENTRY as STRIBECK
from reconcile.recording.kinematics import dahl_deflection
from reconcile.recording.recording import AxisRecording
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem
from reconcile.selection.cross_validation import CrossValidation

T, N = 1e-3, 20_000
t = np.arange(N) * T
ANGLE = 1.0 * np.sin(1.1 * t) + 0.05 * np.sin(3.7 * t)


GEAR = 100.0
AXES = {"geared": AXIS._replace(rotary=True, lead_m=2.0 * np.pi / GEAR), "direct": AXIS._replace(rotary=True)}


def best(friction: Array, effect: str, axis: str = "direct") -> CandidateTerm:
    """The term of the effect that explains most of inertia and friction of a joint."""
    torque = 0.5 * np.gradient(np.gradient(ANGLE, T), T) + friction
    torque += 0.05 * np.random.default_rng(1).normal(size=N)
    counted = np.round(ANGLE / 1e-7) * 1e-7
    recording = AxisRecording("r", "j", T, t, counted, torque, None, None, None, {})
    data = regression_data(recording, AXES[axis])
    shapes = ENTRIES[effect].terms[0].shapes([data])
    problem = regression_problem([data], ResidualChannel.FORCE, [(effect, s) for s in shapes], only=True)
    validation = CrossValidation(problem.equations, np.flatnonzero(problem.equations.samples))
    return min(problem.equations.candidates, key=lambda c: validation.total_squares([c]))


def test_presliding_over_a_tenth_of_a_degree_is_on_the_grid() -> None:
    found = best(4.0 * dahl_deflection(ANGLE, 2e-3), PRESLIDING.name)
    assert found.shape_parameters[0] == pytest.approx(2e-3, rel=0.4)


def test_stribeck_friction_below_a_fifth_of_a_radian_a_second_is_on_the_grid() -> None:
    speed = np.gradient(ANGLE, T)
    found = best(np.sign(speed) * (3.0 + 2.0 * np.exp(-((speed / 0.15) ** 2))), STRIBECK.name)
    assert found.shape_parameters[0] == pytest.approx(0.15, rel=0.3)


def test_a_force_that_comes_twelve_times_a_turn_of_a_geared_joint_is_on_the_grid() -> None:
    """The joint turns by a third of a turn, which is four of its periods and thirty turns of the motor."""
    found = best(0.8 * np.sin(12.0 * ANGLE + 0.3), COGGING.name, "geared")
    assert found.shape_parameters[0] * GEAR == pytest.approx(12.0)


def test_a_force_that_comes_once_in_the_travel_of_a_geared_joint_is_none() -> None:
    found = best(0.8 * np.sin(2.0 * ANGLE + 0.3), COGGING.name, "geared")
    assert found.shape_parameters[0] * GEAR >= 6.0
