"""A map over position and velocity is selected only where no curve over either carries the force."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from formula_residuals import problem

from reconcile.catalogue.kinds import RegressionData
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.regression_problem import regression_problem
from reconcile.selection.map_selection import MAP_EFFECT, select_map
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.unnamed_selection import select_unnamed

Effect = Callable[[RegressionData], np.ndarray]


def along(data: RegressionData) -> np.ndarray:
    return np.sin(2.0 * math.pi * data.motion.position_m / 0.04)


def of_both(data: RegressionData) -> np.ndarray:
    """Neither a force nor a friction, a damping or a mass over the travel."""
    return 6.0 * along(data) * np.cos(math.pi * data.motion.velocity_m_s / 0.06)


def unnamed_with_map(effect: Effect, recordings: int = 2) -> list[str]:
    found = problem(effect, [], recordings=recordings)
    blocks = np.flatnonzero(found.equations.samples)
    one_coordinate = select_unnamed(found, [], blocks, SelectionRules())
    wide = regression_problem(
        found.datasets, found.channel, [(name, shape) for name, shape, _ in one_coordinate], only=True
    )
    chosen = [wide.equations.by_key[key] for key in one_coordinate]
    return [name for name, *_ in select_map(wide, chosen, blocks, SelectionRules())]


def test_a_force_of_position_and_velocity_has_a_map() -> None:
    assert MAP_EFFECT in unnamed_with_map(of_both)


@pytest.mark.parametrize(
    "effect",
    [
        lambda data: 0.0 * data.time_s,
        lambda data: 6.0 * along(data),
        lambda data: 90.0 * along(data) * data.motion.velocity_m_s,
    ],
    ids=["nothing", "a force along the travel", "a damping along the travel"],
)
def test_noise_and_what_a_curve_carries_have_none(effect: Effect) -> None:
    assert unnamed_with_map(effect) == []


def test_one_recording_alone_has_no_map() -> None:
    """What repeats in it would be predicted from itself."""
    assert MAP_EFFECT not in unnamed_with_map(of_both, recordings=1)


def test_the_map_has_its_own_prefix_and_its_smoothness_is_chosen() -> None:
    found = problem(of_both, [], recordings=2)
    blocks = np.flatnonzero(found.equations.samples)
    [(name, shape, own)] = select_map(found, [], blocks, SelectionRules())
    assert (name, own) == (PREFIX + "position_and_velocity", False)
    assert shape[2] == 9.0
    assert shape[5] == 7.0
    assert 0.0 <= shape[6] <= 0.3
