"""Learning from production reversals: direction, size, and when nothing is changed."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_axes import PERIOD_S, SETTINGS

from servo_ctrl.learning.adaptation import DEAD_BAND_SHARE, INFLUENCE_RATIO, MAX_RELATIVE_STEP, adapted
from servo_ctrl.learning.types import Learned, StrokeResult

LEARNED = Learned(
    "fast",
    ((0.002, 0.2), (0.12, 0.05)),
    ((0.002, 0.0003), (0.009, 0.0005), (0.011, 0.0006), (0.03, 0.0009), (0.12, 0.0018)),
    0.0,
    ((0.002, 0.2, 0.1, 1e-4), (0.0115, 0.12, 0.07, -2e-4), (0.12, 0.05, 0.05, -4e-4)),
    5e-6,
    0.8e-6,
    60,
    1000.0,
)


def lagging(error_m: float) -> StrokeResult:
    return StrokeResult(np.full((1, 194), error_m), PERIOD_S)


def changed(error_m: float, a: float = 0.011, learned: Learned = LEARNED) -> dict[float, float]:
    """Ratio of the amplitude after to before, where it is not 1."""
    after = adapted(learned, SETTINGS, a, lagging(error_m))
    assert after is not None
    assert after._replace(amplitudes=(), trailing=()) == learned._replace(amplitudes=(), trailing=())
    pairs = zip(after.amplitudes, learned.amplitudes, strict=True)
    return {a: new / old for (a, new), (_, old) in pairs if new != old}


def test_a_lag_makes_the_amplitude_larger_and_a_lead_smaller_near_the_reversal_only() -> None:
    more, less = changed(2e-6), changed(-2e-6)
    assert set(more) == set(less) == {0.009, 0.011}
    assert more[0.011] > more[0.009] > 1.0
    assert less[0.011] < less[0.009] < 1.0


@given(st.floats(-1e-3, 1e-3), st.floats(0.002, 0.12))
@settings(deadline=None)
def test_one_reversal_changes_little_and_stays_in_bounds(error_m: float, a: float) -> None:
    after = adapted(LEARNED, SETTINGS, a, lagging(error_m))
    if after is None:
        return
    for (place, new), (_, old) in zip(after.amplitudes, LEARNED.amplitudes, strict=True):
        assert abs(new / old - 1.0) <= MAX_RELATIVE_STEP + 1e-12
        assert 0.0 < new <= SETTINGS.amplitude_max_m_s
        assert new == old or max(place / a, a / place) < INFLUENCE_RATIO


def test_a_larger_error_changes_more_until_the_largest_step() -> None:
    steps = [changed(error_m)[0.011] - 1.0 for error_m in (0.5e-6, 1e-6, 5e-6, 50e-6)]
    assert steps[1] == pytest.approx(2.0 * steps[0])
    assert steps[2] > steps[1]
    assert steps[3] == pytest.approx(MAX_RELATIVE_STEP)


def test_the_second_trapezoid_follows_in_proportion_and_keeps_its_times() -> None:
    after = adapted(LEARNED, SETTINGS, 0.011, lagging(5e-6))
    assert after is not None
    ratios = [new[3] / old[3] for new, old in zip(after.trailing, LEARNED.trailing, strict=True)]
    assert ratios[0] == ratios[2] == 1.0
    assert 1.0 < ratios[1] <= 1.0 + MAX_RELATIVE_STEP
    assert [point[:3] for point in after.trailing] == [point[:3] for point in LEARNED.trailing]


@pytest.mark.parametrize("a", [0.0, 0.0019, 0.121, 3.0])
def test_reversals_outside_the_learned_range_change_nothing(a: float) -> None:
    assert adapted(LEARNED, SETTINGS, a, lagging(9e-6)) is None


def test_an_error_within_the_dead_band_changes_nothing() -> None:
    limit_m = DEAD_BAND_SHARE * LEARNED.after_m
    assert adapted(LEARNED, SETTINGS, 0.011, lagging(limit_m * 0.99)) is None
    assert adapted(LEARNED, SETTINGS, 0.011, lagging(-limit_m * 0.99)) is None
    assert adapted(LEARNED, SETTINGS, 0.011, lagging(limit_m * 1.01)) is not None


@pytest.mark.parametrize("error_m", [math.nan, math.inf])
def test_a_trace_with_a_gap_changes_nothing(error_m: float) -> None:
    result = lagging(5e-6)
    result.error_m[0, 7] = error_m
    assert adapted(LEARNED, SETTINGS, 0.011, result) is None


def test_at_the_largest_amplitude_nothing_grows_any_more() -> None:
    full = LEARNED._replace(
        amplitudes=((0.1, SETTINGS.amplitude_max_m_s), (0.12, SETTINGS.amplitude_max_m_s))
    )
    assert adapted(full, SETTINGS, 0.11, lagging(9e-6)) is None
    assert adapted(full, SETTINGS, 0.11, lagging(-9e-6)) is not None


def test_functions_without_a_second_trapezoid_get_none() -> None:
    after = adapted(LEARNED._replace(trailing=()), SETTINGS, 0.011, lagging(5e-6))
    assert after is not None
    assert after.trailing == ()
