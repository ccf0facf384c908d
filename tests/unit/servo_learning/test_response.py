"""The response of a known axis is identified, and the pulse that follows is as good as scipy's."""

import numpy as np
import pytest
from scipy.optimize import differential_evolution
from scipy.signal import fftconvolve
from synthetic_axes import PERIOD_S, response, trapezoids

from servo_ctrl.learning.response import (
    KNOTS_S,
    PulseResponse,
    TriedStroke,
    basis_of,
    best_pulse,
    best_stroke,
    convolved,
    fit_response,
    pulse_samples,
    rms_m,
    with_trailing,
)
from servo_ctrl.learning.types import NO_PULSE, Pulse

SAMPLES = 300
LOOP = PulseResponse(np.zeros(len(KNOTS_S)), 0.01, PERIOD_S, 2e-6, 0.002)
MAIN = ("amplitude_m_s", "duration_s")
TRAILING = ("trailing_amplitude_m_s", "trailing_start_s", "trailing_duration_s")
TIME_S = np.arange(SAMPLES) * PERIOD_S
ERROR_M = 30e-6 * (TIME_S / 0.05) * np.exp(-TIME_S / 0.05) - 4e-6 * np.exp(-(((TIME_S - 0.17) / 0.03) ** 2))
"""Without a pulse: a hump, and an overshoot when the friction lets go."""


def stroke(pulse: Pulse) -> TriedStroke:
    answer_m = fftconvolve(response(SAMPLES), trapezoids(pulse, 0.01, SAMPLES))[:SAMPLES] * PERIOD_S
    return TriedStroke(pulse, np.tile(ERROR_M - answer_m, (2, 1)))


def learned_loop() -> tuple[PulseResponse, list[TriedStroke]]:
    strokes = [stroke(p) for p in (NO_PULSE, Pulse(0.06, 0.0004), Pulse(0.09, 0.0006), Pulse(0.05, 0.0008))]
    return fit_response(strokes, best_stroke(strokes[1:]), LOOP), strokes


@pytest.mark.parametrize(
    "pulse", [Pulse(0.06, 0.001), Pulse(0.015, 0.001), Pulse(0.1, 0.001, 0.14, 0.05, -5e-4), NO_PULSE]
)
def test_pulse_samples_are_two_trapezoids(pulse: Pulse) -> None:
    assert pulse_samples(pulse, LOOP, SAMPLES) == pytest.approx(trapezoids(pulse, 0.01, SAMPLES), abs=1e-18)


def test_both_trapezoids_together_stay_within_the_largest_amplitude() -> None:
    sum_m_s = pulse_samples(Pulse(0.1, 0.0018, 0.05, 0.1, 0.0015), LOOP, SAMPLES)
    assert sum_m_s.max() == LOOP.amplitude_max_m_s


def test_hat_functions_span_every_piecewise_linear_function() -> None:
    knot_values = np.random.default_rng(1).normal(size=len(KNOTS_S))
    expected = np.interp(TIME_S, KNOTS_S, knot_values)
    assert basis_of(SAMPLES, PERIOD_S) @ knot_values == pytest.approx(expected)


def test_the_convolution_is_the_sum_written_out() -> None:
    h, p = np.random.default_rng(2).normal(size=(2, 40))
    expected = [sum(h[n - k] * p[k] for k in range(n + 1)) * 0.5 for n in range(40)]
    assert convolved(h, p, 0.5) == pytest.approx(np.array(expected))


def test_errors_of_untried_strokes_are_predicted() -> None:
    loop, strokes = learned_loop()
    best = best_stroke(strokes[1:])
    knot_values = basis_of(SAMPLES, PERIOD_S) @ loop.knot_values
    for pulse in (Pulse(0.07, 0.0007), Pulse(0.12, 0.0003), Pulse(0.06, 0.0006, 0.12, 0.06, -2e-4)):
        change = trapezoids(pulse, 0.01, SAMPLES) - trapezoids(best.pulse, 0.01, SAMPLES)
        foretold_m = best.error_m[0] - convolved(knot_values, change, PERIOD_S)
        made_m = stroke(pulse).error_m[0]
        assert rms_m(foretold_m - made_m) <= 0.05 * rms_m(made_m - best.error_m[0])


def test_the_best_pulse_is_as_good_as_a_global_search_on_the_axis_itself() -> None:
    loop, strokes = learned_loop()
    best = best_stroke(strokes[1:])
    pulse, _ = best_pulse(best, loop, best.pulse, MAIN)
    search = differential_evolution(
        lambda x: rms_m(stroke(Pulse(*x)).error_m), [(0.02, 0.3), (0.0, 0.002)], seed=1, tol=1e-8
    )
    assert rms_m(stroke(pulse).error_m) <= 1.03 * search.fun


def test_with_a_second_trapezoid_the_overshoot_goes_as_well() -> None:
    loop, strokes = learned_loop()
    best = best_stroke(strokes[1:])
    single, _ = best_pulse(best, loop, best.pulse, MAIN)
    double, _ = best_pulse(best, loop, with_trailing(best, loop), (*TRAILING, *MAIN))
    search = differential_evolution(
        lambda x: rms_m(stroke(Pulse(*x)).error_m),
        [(0.02, 0.3), (0.0, 0.002), (0.0, 0.3), (0.02, 0.3), (-0.002, 0.002)],
        seed=1,
        maxiter=60,
    )
    assert rms_m(stroke(double).error_m) <= 0.75 * rms_m(stroke(single).error_m)
    assert rms_m(stroke(double).error_m) <= 1.05 * search.fun


def test_the_search_keeps_what_it_may_not_change_and_stays_in_bounds() -> None:
    loop, strokes = learned_loop()
    small = loop._replace(amplitude_max_m_s=0.0003)
    best = best_stroke(strokes[1:])
    start = Pulse(0.06, 0.0003, 0.1, 0.05, 1e-4)
    pulse, _ = best_pulse(best, small, start, MAIN)
    assert pulse[2:] == start[2:]
    assert loop.amplitude_min_m_s <= pulse.amplitude_m_s <= 0.0003
    assert 2.0 * loop.rise_s <= pulse.duration_s <= SAMPLES * PERIOD_S


def test_equal_strokes_carry_no_information_and_leave_the_pulse_unchanged() -> None:
    one = stroke(Pulse(0.06, 0.0005))
    loop = fit_response([one, one], one, LOOP)
    assert (loop.knot_values == LOOP.knot_values).all()
    assert best_pulse(one, loop, one.pulse, MAIN)[0] == one.pulse
    assert with_trailing(one, loop).trailing_amplitude_m_s == 0.0


@pytest.mark.parametrize("samples", [5, 25])
def test_a_trace_shorter_than_two_rise_times_gives_a_whole_trapezoid_at_least(samples: int) -> None:
    strokes = [TriedStroke(t.pulse, t.error_m[:, :samples]) for t in learned_loop()[1]]
    best = best_stroke(strokes[1:])
    loop = fit_response(strokes, best, LOOP)
    for start in (best.pulse, with_trailing(best, loop)):
        pulse, foretold_m = best_pulse(best, loop, start, (*TRAILING, *MAIN))
        assert np.isfinite([*pulse, foretold_m]).all()
        assert pulse.duration_s >= 2.0 * loop.rise_s
