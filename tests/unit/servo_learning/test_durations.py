"""Duration learning: its strokes worked out by hand, and the duration it keeps."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_axes import SETTINGS, ScoredAxis, follow

from servo_ctrl.learning.durations import coarse_amplitudes_m_s, durations_tried_s, learn_durations

SMALL = SETTINGS._replace(
    accelerations_m_s2=(1.0, 2.0, 3.0, 5.0),
    coarse_steps=2,
    initial_share=0.5,
    amplitude_max_m_s=0.004,
    duration_step_s=0.01,
    duration_reach=1.5,
)


def test_strokes_are_those_worked_out_by_hand() -> None:
    intervals = {1.0: 0.04, 2.0: 0.03, 3.0: 0.02, 5.0: 0.02}
    axis = ScoredAxis(intervals.__getitem__, lambda _a, _t, _v: 1e-6)
    _, strokes = follow(learn_durations(SMALL), axis)
    found = [(s.stage, s.acceleration_m_s2, *(round(value, 9) for value in s.pulse)) for s in strokes]
    tried = [
        (a, duration, amplitude)
        for a, durations in (
            (1.0, (0.04, 0.05, 0.06)),
            (2.0, (0.03, 0.04)),  # 0.045 is not reached
            (3.0, (0.02, 0.03)),
            (5.0, (0.02, 0.03)),
        )
        for duration in durations
        for amplitude in (0.002, 0.004)
    ]
    expected = [("interval", a, 0.0, 0.0, 0.0, 0.0, 0.0) for a in (1.0, 2.0, 3.0, 5.0)]
    expected += [("duration", *stroke, 0.0, 0.0, 0.0) for stroke in tried]
    assert found == expected


@settings(deadline=None)
@given(st.floats(0.02, 0.05), st.floats(0.02, 0.05), st.floats(0.0002, 0.002))
def test_the_kept_duration_is_the_tried_one_nearest_to_the_best(
    at_min: float, at_max: float, top: float
) -> None:
    def best_s(a: float) -> float:
        return at_min + (at_max - at_min) * (a - 0.002) / 0.118

    def score(a: float, duration_s: float, amplitude: float) -> float:
        return 1e-6 + 1e-3 * (duration_s - best_s(a)) ** 2 + (amplitude - top) ** 2

    durations, _ = follow(learn_durations(SETTINGS), ScoredAxis(lambda _a: 0.03, score))
    assert [a for a, _ in durations] == list(SETTINGS.accelerations_m_s2)
    for a, found_s in durations:
        tried = [0.03, 0.04]
        assert abs(found_s - best_s(a)) <= min(abs(t - best_s(a)) for t in tried) + 1e-9


def test_of_equal_durations_the_shorter_is_kept() -> None:
    durations, _ = follow(learn_durations(SETTINGS), ScoredAxis(lambda _a: 0.03, lambda _a, _t, _v: 1e-6))
    assert [duration for _, duration in durations] == pytest.approx([0.03] * 4)


def test_an_error_that_peaks_at_the_reversal_itself_begins_with_one_step() -> None:
    durations, strokes = follow(
        learn_durations(SETTINGS), ScoredAxis(lambda _a: 0.0, lambda _a, _t, _v: 1e-6)
    )
    assert all(duration > 0.0 for _, duration in durations)
    assert all(stroke.pulse.duration_s > 0.0 for stroke in strokes if stroke.stage == "duration")


def test_the_last_duration_is_tried_in_spite_of_rounding() -> None:
    settings = SETTINGS._replace(duration_reach=1.2, duration_step_s=0.005)
    assert durations_tried_s(settings, 0.05) == pytest.approx([0.05, 0.055, 0.06])


def test_amplitudes_go_from_a_share_of_the_largest_to_the_largest() -> None:
    amplitudes = coarse_amplitudes_m_s(SETTINGS)
    assert amplitudes == pytest.approx([0.0002 * n for n in range(1, 11)])
    assert amplitudes[-1] == SETTINGS.amplitude_max_m_s
