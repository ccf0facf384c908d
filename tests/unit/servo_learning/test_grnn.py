"""The regression network against its formula written out, and at its limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from servo_ctrl.learning.grnn import CANDIDATE_SPREADS, leave_one_out_spread, regression

POINTS = np.array([2.0, 5.0, 8.0, 19.0, 30.0, 120.0]) * 1e-3
VALUES = np.array([0.2, 0.3, 0.39, 0.53, 0.8, 1.77]) * 1e-3


def written_out(a: float, spread: float, points: list[float], values: list[float]) -> float:
    above = below = 0.0
    for point, value in zip(points, values, strict=True):
        weight = math.exp(-((a - point) ** 2) / (2.0 * spread**2))
        above += value * weight
        below += weight
    return above / below


@settings(deadline=None)
@given(st.floats(0.0, 0.15), st.floats(5e-3, 1.0))
def test_prediction_equals_the_published_formula(a: float, spread: float) -> None:
    expected = written_out(a, spread, POINTS.tolist(), VALUES.tolist())
    assert regression(POINTS, VALUES, spread, np.array([a]))[0] == pytest.approx(expected, rel=1e-9)


@settings(deadline=None)
@given(st.floats(0.0, 1.0), st.floats(1e-7, 10.0))
def test_prediction_stays_between_the_smallest_and_the_largest_value(a: float, spread: float) -> None:
    found = regression(POINTS, VALUES, spread, np.array([a]))[0]
    assert VALUES.min() * (1 - 1e-12) <= found <= VALUES.max() * (1 + 1e-12)


def test_a_small_spread_gives_the_nearest_point_however_far() -> None:
    at = np.array([0.0, 3.4e-3, 3.6e-3, 25e-3, 76e-3, 5.0])
    nearest = VALUES[[0, 0, 1, 4, 5, 5]]
    assert regression(POINTS, VALUES, 1e-6, at).tolist() == pytest.approx(nearest.tolist())


def test_a_large_spread_gives_the_mean() -> None:
    found = regression(POINTS, VALUES, 1e4, np.array([0.0, 0.05]))
    assert found.tolist() == pytest.approx([VALUES.mean()] * 2)


def test_the_spread_minimises_the_leave_one_out_error() -> None:
    def misfit(spread: float) -> float:
        total = 0.0
        for i in range(len(POINTS)):
            points, values = POINTS.tolist(), VALUES.tolist()
            a, value = points.pop(i), values.pop(i)
            exponents = [-((a - point) ** 2) / (2.0 * spread**2) for point in points]
            weights = [math.exp(exponent - max(exponents)) for exponent in exponents]
            foretold = sum(w * v for w, v in zip(weights, values, strict=True)) / sum(weights)
            total += (foretold - value) ** 2
        return total

    found = leave_one_out_spread(POINTS, VALUES)
    tried = [
        0.2 * 3e-3 * (118e-3 / (0.2 * 3e-3)) ** (i / (CANDIDATE_SPREADS - 1))
        for i in range(CANDIDATE_SPREADS)
    ]
    assert found == pytest.approx(min(tried, key=misfit))


def test_two_points_are_enough() -> None:
    spread = leave_one_out_spread(POINTS[:2], VALUES[:2])
    assert 0.0 < spread <= POINTS[1] - POINTS[0]
