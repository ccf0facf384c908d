"""Amplitude learning: its strokes worked out by hand, and the amplitudes it keeps."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_axes import SETTINGS, ScoredAxis, follow

from servo_ctrl.learning.amplitudes import (
    coarse_accelerations,
    fine_amplitudes_m_s,
    learn_amplitudes,
    with_midpoints,
)

SMALL = SETTINGS._replace(
    accelerations_m_s2=(1.0, 2.0, 3.0, 5.0),
    steps=(1, 2, 1),
    coarse_steps=2,
    fine_steps=2,
    initial_share=0.5,
    amplitude_max_m_s=0.004,
)
DURATIONS = ((1.0, 0.05), (2.0, 0.04), (3.0, 0.02), (5.0, 0.01))


def rounded(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(round(value, 9) for value in values)


def test_strokes_are_those_worked_out_by_hand() -> None:
    def score(a: float, _duration: float, amplitude: float) -> float:
        return abs(amplitude - (0.003 if a < 5.0 else 0.004))

    points, strokes = follow(learn_amplitudes(SMALL, DURATIONS), ScoredAxis(lambda _a: 0.05, score))
    coarse = [
        ("coarse", a, duration, amplitude)
        for a, duration in ((1.0, 0.05), (2.0, 0.04), (2.5, 0.03), (3.0, 0.02), (5.0, 0.01))
        for amplitude in (0.002, 0.003, 0.004)
    ]
    fine = [
        ("fine", a, duration, amplitude)
        for a, duration, amplitudes in (
            (1.0, 0.05, (0.002, 0.003, 0.004)),
            (1.5, 0.045, (0.002, 0.003, 0.004)),
            (2.0, 0.04, (0.002, 0.003, 0.004)),
            (2.25, 0.035, (0.002, 0.003, 0.004)),
            (2.5, 0.03, (0.002, 0.003, 0.004)),
            (2.75, 0.025, (0.002, 0.003, 0.004)),
            (3.0, 0.02, (0.002, 0.003, 0.004)),
            (4.0, 0.015, (0.0025, 0.00325, 0.004)),  # about 0.0035, cut off at A_max
            (5.0, 0.01, (0.003, 0.0035, 0.004)),
        )
        for amplitude in amplitudes
    ]
    found = [(s.stage, *rounded((s.acceleration_m_s2, *s.pulse[:2]))) for s in strokes]
    assert found == coarse + fine
    assert [rounded(point) for point in points] == [
        *((a, 0.003) for a in (1.0, 1.5, 2.0, 2.25, 2.5, 2.75, 3.0)),
        (4.0, 0.00325),
        (5.0, 0.004),
    ]


@settings(deadline=None)
@given(st.floats(0.0003, 0.0019), st.floats(0.0003, 0.0019))
def test_each_kept_amplitude_is_half_a_fine_step_from_the_best(at_min: float, at_max: float) -> None:
    def best_m_s(a: float) -> float:
        return at_min + (at_max - at_min) * (a - 0.002) / 0.118

    def score(a: float, duration_s: float, amplitude: float) -> float:
        return 1e-7 + (amplitude - best_m_s(a)) ** 2 + 0.0 * duration_s

    durations = tuple((a, 0.03) for a in SETTINGS.accelerations_m_s2)
    points, _ = follow(learn_amplitudes(SETTINGS, durations), ScoredAxis(lambda _a: 0.03, score))
    coarse_step = 0.9 * SETTINGS.amplitude_max_m_s / SETTINGS.coarse_steps
    fine_step = 2.0 * coarse_step / SETTINGS.fine_steps
    for a, amplitude in points:
        assert abs(amplitude - best_m_s(a)) <= 0.5 * fine_step + 1e-12


def test_accelerations_are_equal_steps_in_each_interval() -> None:
    expected = [0.002, 0.005, 0.008, 0.03, 0.075, 0.12]
    assert coarse_accelerations(SETTINGS) == pytest.approx(expected)


def test_midpoints_take_the_mean_of_their_neighbours() -> None:
    assert with_midpoints([(1.0, 4.0), (2.0, 6.0), (5.0, 0.0)]) == [
        (1.0, 4.0),
        (1.5, 5.0),
        (2.0, 6.0),
        (3.5, 3.0),
        (5.0, 0.0),
    ]


@settings(deadline=None)
@given(st.floats(0.0, 1.0), st.integers(1, 40), st.integers(1, 40), st.floats(0.01, 0.5))
def test_fine_amplitudes_are_positive_bounded_and_as_many_as_planned(
    place: float, coarse_steps: int, fine_steps: int, share: float
) -> None:
    settings = SETTINGS._replace(fine_steps=fine_steps)
    top = settings.amplitude_max_m_s
    reach = (1.0 - share) * top / coarse_steps
    tried = fine_amplitudes_m_s(settings, top * (share + (1.0 - share) * place), reach)
    assert len(tried) == fine_steps + 1
    assert min(tried) > 0.0
    assert max(tried) <= top


def test_inside_the_bounds_the_fine_step_is_two_coarse_steps_over_the_fine_steps() -> None:
    tried = fine_amplitudes_m_s(SETTINGS, 0.001, 0.0002)
    assert tried == pytest.approx([0.0008, 0.0009, 0.001, 0.0011, 0.0012])
