"""Unnamed terms are selected for a real residual, over the coordinate that it depends on."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from formula_residuals import data, problem

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.regression_problem import regression_problem
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.unnamed_selection import select_unnamed


def bump(data: RegressionData) -> np.ndarray:
    """A force at one place of the travel, whatever the speed: no entry of the catalogue is like it."""
    return 8.0 * np.exp(-(((data.motion.position_m - 0.01) / 0.008) ** 2))


def cogging(data: RegressionData) -> np.ndarray:
    return 3.0 * np.sin(4.0 * 2.0 * math.pi * data.motion.position_m / data.lead_m)


def terms_of(effect: Callable[[RegressionData], np.ndarray], *, named: bool = False) -> list[str]:
    found = problem(effect, [("cogging", (4.0,))])
    chosen = found.equations.candidates if named else []
    blocks = np.flatnonzero(found.equations.samples)
    return [name for name, *_ in select_unnamed(found, chosen, blocks, SelectionRules())]


def test_a_position_dependent_force_is_reported_by_its_coordinate() -> None:
    assert terms_of(bump)[0] == PREFIX + "position"


def test_noise_and_named_effects_need_no_unnamed_term() -> None:
    assert terms_of(cogging, named=True) == []


@pytest.mark.parametrize(
    ("coordinate", "effect"),
    [
        ("position", lambda data: 12.0 * np.exp(-(((data.motion.position_m - 0.01) / 5e-4) ** 2))),
        ("position_by_direction", lambda data: 3.0 * wave(data) * data.motion.direction),
        ("position_of_the_damping", lambda data: 60.0 * wave(data) * data.motion.velocity_m_s),
        ("position_of_the_mass", lambda data: 15.0 * wave(data) * data.motion.acceleration_m_s2),
        ("run_time_of_the_damping", lambda data: 80.0 * (data.time_s % 8.0 < 3.0) * data.motion.velocity_m_s),
    ],
)
def test_what_changes_along_a_coordinate_is_found_over_it(
    coordinate: str, effect: Callable[[RegressionData], np.ndarray]
) -> None:
    assert terms_of(effect)[0] == PREFIX + coordinate


def wave(data: RegressionData) -> np.ndarray:
    """Some periods along the travel: nine knots would miss them."""
    return np.sin(2.0 * math.pi * data.motion.position_m / 0.014)


def test_a_change_in_one_recording_is_found_as_its_own() -> None:
    rng = np.random.default_rng(3)
    given = [data(0), data(1)]
    forces = [one.force_n + 0.3 * rng.normal(size=len(one.time_s)) for one in given]
    forces[1] += np.where(given[1].time_s > 13.2, 9.0, 0.0)
    measured = [one._replace(force_n=force) for one, force in zip(given, forces, strict=True)]
    found = regression_problem(measured, ResidualChannel.FORCE, only=True)
    blocks = np.flatnonzero(found.equations.samples)
    [(name, (moment_s,), own)] = select_unnamed(found, [], blocks, SelectionRules())
    assert name == PREFIX + "moment_of_force_in_a_recording"
    assert moment_s == pytest.approx(13.2, abs=0.5)
    assert own
