"""Change detection over a sequence: rate of false alarms, onset, and comparison of similar motions only."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from reconcile.watch.change_detection import (
    IndicatorSeries,
    covariance,
    lengths_after_step,
    newest_alarm,
    onset,
)


def a_sequence(values: np.ndarray, **other: object) -> IndicatorSeries:
    n = len(values)
    nothing = IndicatorSeries(values, np.full(n, 1.0), np.zeros((n, 2)), np.full(n, np.nan), 0.0, 0.0)
    return nothing._replace(**other)


def first_alarm(sequence: IndicatorSeries, indicators: int = 10, run_length: float = 1000.0) -> int | None:
    """Return the number of recordings at the alarm."""
    for n in range(1, len(sequence.values) + 1):
        seen = sequence._replace(
            values=sequence.values[:n],
            errors=sequence.errors[:n],
            features=sequence.features[:n],
            temperature_k=sequence.temperature_k[:n],
        )
        alarm = newest_alarm(seen, indicators, run_length)
        if alarm is not None and alarm.raised:
            return n
    return None


def test_false_alarms_stay_below_the_stated_rate() -> None:
    """One false alarm in 50 recordings, so that they can be counted; once with errors twice those stated."""
    rng = np.random.default_rng(1)
    found = 0
    for scale in (1.0, 2.0):
        alarms = [first_alarm(a_sequence(scale * rng.normal(size=20)), 1, 50.0) for _ in range(30)]
        recordings = sum(20 if n is None else n for n in alarms)
        found += sum(n is not None for n in alarms)
        assert sum(n is not None for n in alarms) <= 1.5 * recordings / 50.0
    assert found > 0, "a test that never alarms proves nothing"


def test_a_step_is_found_soon_and_dated() -> None:
    rng = np.random.default_rng(2)
    inside, delays = 0, []
    for k in range(10, 26):
        values = rng.normal(size=40) + 5.0 * (np.arange(40) >= k)
        n = first_alarm(a_sequence(values))
        assert n is not None
        assert n >= k
        delays.append(n - k)
        when = onset(a_sequence(values))
        inside += when.low <= k <= when.high
        assert when.ramp_probability < 0.1
    assert inside >= 14  # of 16, at 95 %
    assert np.median(delays) <= 5


def test_a_ramp_is_distinguished_from_a_step() -> None:
    rng = np.random.default_rng(3)
    for k in (12, 18, 24):
        values = rng.normal(size=40) + 1.0 * np.maximum(np.arange(40) - k + 1.0, 0.0)
        when = onset(a_sequence(values))
        assert when.ramp_probability > 0.9
        assert when.low <= k <= when.high


def test_one_odd_recording_is_no_change() -> None:
    rng = np.random.default_rng(4)
    values = rng.normal(size=30)
    values[20] += 40.0
    assert first_alarm(a_sequence(values)) is None


def test_another_kind_of_motion_is_no_change() -> None:
    rng = np.random.default_rng(5)
    values = rng.normal(size=30) + 8.0 * (np.arange(30) >= 15)
    features = np.zeros((30, 2))
    assert first_alarm(a_sequence(values)) is not None
    features[15:] = 2.0
    assert first_alarm(a_sequence(values, features=features, motion_spread=8.0)) is None


def test_a_temperature_effect_is_no_change() -> None:
    rng = np.random.default_rng(6)
    warm = 293.0 + 4.0 * np.sin(np.arange(40) / 5.0)
    values = rng.normal(size=40) * 0.2 - 1.5 * (warm - 293.0)
    assert first_alarm(a_sequence(values, errors=np.full(40, 0.2))) is not None
    sequence = a_sequence(values, errors=np.full(40, 0.2), temperature_k=warm)
    assert first_alarm(sequence) is None
    stepped = values - 4.0 * (np.arange(40) >= 25)
    assert first_alarm(sequence._replace(values=stepped)) in range(26, 34)


def test_a_negligible_change_is_not_reported() -> None:
    values = np.random.default_rng(7).normal(size=30) + 8.0 * (np.arange(30) >= 15)
    assert first_alarm(a_sequence(values, min_change=12.0)) is None


def test_an_uncertain_recording_has_little_weight() -> None:
    values = np.random.default_rng(8).normal(size=30)
    errors = np.where(np.arange(30) >= 25, 20.0, 1.0)
    assert first_alarm(a_sequence(values + 30.0 * (errors > 1.0), errors=errors)) is None


def test_onset_is_the_posterior_by_brute_force() -> None:
    """With a known scale of the errors, so that the densities are normal."""
    rng = np.random.default_rng(9)
    n, k = 12, 7
    features = rng.normal(size=(n, 2)) * 0.3
    values = rng.normal(size=n) + 6.0 * (np.arange(n) >= k)
    given = a_sequence(values, features=features, motion_spread=1.5)
    total = covariance(given)
    wide = 1e6
    odds = []
    for first in range(1, n):
        step = (np.arange(n) >= first).astype(float)
        prior = total + wide * np.ones((n, n)) + wide * np.outer(step, step)
        odds.append(multivariate_normal(np.zeros(n), prior).logpdf(values))
    assert 1 + int(np.argmax(odds)) == onset(given).first == k


@pytest.mark.parametrize(("recordings", "after"), [(7, []), (8, [2]), (14, [2, 3, 4, 6, 8])])
def test_tested_steps_leave_enough_before_them(recordings: int, after: list[int]) -> None:
    assert lengths_after_step(recordings) == after
