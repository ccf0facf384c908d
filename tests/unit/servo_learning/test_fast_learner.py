"""The faster learner on axes whose best pulse is known."""

import math
from collections.abc import Sequence
from functools import cache
from itertools import groupby

import numpy as np
import pytest
from synthetic_axes import PERIOD_S, SETTINGS, LinearAxis, follow

from servo_ctrl.learning import fast
from servo_ctrl.learning.fast import in_whole_steps, learn_fast
from servo_ctrl.learning.response import PulseResponse, TriedStroke, fit_response, rms_m
from servo_ctrl.learning.stroke_result import first_samples
from servo_ctrl.learning.types import NO_PULSE, Pulse, Stroke, StrokeResult

FAST = SETTINGS._replace(learner="fast", window_s=0.3)
DOUBLE = FAST._replace(trailing=True)


def best(a: float) -> Pulse:
    return Pulse(0.06 * (0.03 / a) ** 0.4, 0.0006 * (a / 0.03) ** 0.5)


def best_with_trailing(a: float) -> Pulse:
    return best(a)._replace(
        trailing_start_s=0.12 * (0.03 / a) ** 0.4,
        trailing_duration_s=0.05,
        trailing_amplitude_m_s=-0.0002 * (a / 0.03) ** 0.5,
    )


@cache
def double_run() -> tuple[tuple[tuple[float, Pulse], ...], list[Stroke]]:
    """What is learned where two trapezoids are needed, and the strokes."""
    return follow(learn_fast(DOUBLE), LinearAxis(best_with_trailing, DOUBLE))


def left_over(axis: LinearAxis, a: float, pulse: Pulse) -> float:
    """Share of the RMS without a pulse."""
    made, without = (axis(Stroke("check", a, p)) for p in (pulse, NO_PULSE))
    return rms_m(first_samples(made, 0.3)) / rms_m(first_samples(without, 0.3))


def test_a_trapezoid_that_would_leave_no_error_is_found_in_a_few_strokes() -> None:
    axis = LinearAxis(best, FAST)
    found, strokes = follow(learn_fast(FAST), axis)
    assert [a for a, _ in found] == pytest.approx(np.geomspace(0.002, 0.12, fast.ACCELERATIONS).tolist())
    assert max(left_over(axis, a, pulse) for a, pulse in found) <= 0.05
    assert len(strokes) <= fast.ACCELERATIONS * (2 + fast.SEARCH_STROKES)


def test_two_trapezoids_are_found_where_two_are_needed() -> None:
    axis = LinearAxis(best_with_trailing, DOUBLE)
    double, _ = double_run()
    single, _ = follow(learn_fast(FAST), axis)
    rest_double = np.mean([left_over(axis, a, pulse) for a, pulse in double])
    rest_single = np.mean([left_over(axis, a, pulse) for a, pulse in single])
    assert rest_double <= 0.5 * rest_single
    assert all(pulse.trailing_amplitude_m_s == 0.0 for _, pulse in single)


def test_strokes_go_from_the_shortest_to_the_longest_in_stages() -> None:
    _, strokes = double_run()
    accelerations = [a for a, _ in groupby(s.acceleration_m_s2 for s in strokes)]
    assert accelerations == pytest.approx(np.geomspace(0.12, 0.002, fast.ACCELERATIONS).tolist())
    for _, group in groupby(strokes, key=lambda s: s.acceleration_m_s2):
        counts = [(stage, len(list(part))) for stage, part in groupby(group, key=lambda s: s.stage)]
        assert counts[0] == ("interval", 1)
        for stage, count in counts[1:]:
            most = {"search": 1 + fast.SEARCH_STROKES, "trailing": fast.TRAILING_STROKES}
            assert count <= most[stage]


@pytest.mark.parametrize("trailing", [False, True])
def test_pulses_of_every_stroke_stay_within_their_bounds(*, trailing: bool) -> None:
    settings = FAST._replace(trailing=trailing, amplitude_max_m_s=0.0005)
    found, strokes = follow(learn_fast(settings), LinearAxis(best_with_trailing, settings))
    for pulse in [*(s.pulse for s in strokes if s.pulse != NO_PULSE), *(pulse for _, pulse in found)]:
        assert 0.0 < pulse.amplitude_m_s <= 0.0005
        assert abs(pulse.trailing_amplitude_m_s) <= 0.0005
        assert pulse.duration_s >= 2.0 * settings.rise_s


@pytest.mark.parametrize("trailing", [False, True])
def test_an_axis_without_any_error_gets_a_pulse_too_small_to_matter(*, trailing: bool) -> None:
    settings = FAST._replace(trailing=trailing)
    found, strokes = follow(learn_fast(settings), lambda _stroke: StrokeResult(np.zeros((2, 800)), PERIOD_S))
    assert all(0.0 < pulse.amplitude_m_s <= 1e-3 * settings.amplitude_max_m_s for _, pulse in found)
    assert len(strokes) == 2 * fast.ACCELERATIONS


def test_if_every_pulse_is_harmful_the_smallest_is_learned() -> None:
    """An axis that overshoots by itself."""

    def contrary(stroke: Stroke) -> StrokeResult:
        wanted = LinearAxis(best, FAST)(Stroke("", stroke.acceleration_m_s2, NO_PULSE)).error_m
        made = LinearAxis(lambda _a: NO_PULSE, FAST)(stroke).error_m
        return StrokeResult(-wanted + made, PERIOD_S)

    found, _ = follow(learn_fast(FAST), contrary)
    for a, pulse in found:
        assert math.isfinite(pulse.duration_s)
        assert 0.0 < pulse.amplitude_m_s <= 0.05 * best(a).amplitude_m_s


@pytest.mark.parametrize("period_s", [0.25e-3, 2e-3])
def test_other_sample_periods_give_the_same_pulses(period_s: float) -> None:
    axis = LinearAxis(best, FAST)

    def sampled(stroke: Stroke) -> StrokeResult:
        result = axis(stroke)
        time_s = np.arange(round(0.8 / period_s)) * period_s
        known_s = np.arange(800) * PERIOD_S
        return StrokeResult(np.stack([np.interp(time_s, known_s, row) for row in result.error_m]), period_s)

    found, _ = follow(learn_fast(FAST), sampled)
    assert max(left_over(axis, a, pulse) for a, pulse in found) <= 0.06


def test_a_trace_shorter_than_the_window_is_no_longer_in_time() -> None:
    axis = LinearAxis(best, FAST)
    long = FAST._replace(window_s=5.0)
    found, _ = follow(learn_fast(long), axis)
    assert max(left_over(axis, a, pulse) for a, pulse in found) <= 0.06


def test_proposed_pulses_are_in_whole_microseconds_and_millionths_of_the_largest_amplitude() -> None:
    _, strokes = double_run()
    for stroke in strokes:
        duration_s, amplitude, start_s, trailing_s, trailing = stroke.pulse
        steps = [
            *(1e6 * time_s for time_s in (duration_s, start_s, trailing_s)),
            *(1e6 * value / DOUBLE.amplitude_max_m_s for value in (amplitude, trailing)),
        ]
        assert steps == pytest.approx([round(step) for step in steps], abs=1e-6)


def test_whole_steps_do_not_lead_beyond_the_largest_amplitude() -> None:
    top = 0.0012345678999
    pulse = in_whole_steps(Pulse(0.0123456789, top * 1.1, 0.1, 0.2, -top), top)
    assert pulse == Pulse(0.012346, top, 0.1, 0.2, -top)


def test_the_last_bits_of_linear_algebra_do_not_change_the_strokes(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(5)
    _, expected = double_run()

    def trembling(
        strokes: Sequence[TriedStroke], best_so_far: TriedStroke, loop: PulseResponse
    ) -> PulseResponse:
        knot_values = fit_response(strokes, best_so_far, loop).knot_values
        return loop._replace(knot_values=knot_values * (1.0 + 1e-12 * random.normal(size=knot_values.shape)))

    monkeypatch.setattr(fast, "fit_response", trembling)
    assert follow(learn_fast(DOUBLE), LinearAxis(best_with_trailing, DOUBLE))[1] == expected


def test_noise_and_reversals_that_differ_leave_a_pulse_that_is_nearly_as_good() -> None:
    random = np.random.default_rng(1)
    axis = LinearAxis(best, FAST)

    def restless(stroke: Stroke) -> StrokeResult:
        error_m = axis(stroke).error_m
        size = 1.0 + 0.05 * random.normal(size=(2, 1))
        return StrokeResult(error_m * size + 0.2e-6 * random.normal(size=error_m.shape), PERIOD_S)

    found, _ = follow(learn_fast(FAST), restless)
    assert max(left_over(axis, a, pulse) for a, pulse in found) <= 0.15
