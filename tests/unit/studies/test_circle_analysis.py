"""Circles of a synthetic recording: a known error after every reversal of x."""

from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.metrology.circles import analyse_circles, figures_um
from servo_ctrl.recording.reader import Recording
from studies.feng_2015.circles import summary
from studies.feng_2015.published import FENG_2015_X_UNCOMPENSATED, relative_errors_percent

PERIOD_S, RADIUS_M, WINDOW_S = 1e-3, 0.025, 0.2
ERROR_M, ERROR_SAMPLES = 10e-6, 50


def circle_recording(feed_m_s: float = 0.05, turns: float = 2.0, ramp: int = 100) -> Recording:
    """Constant speed after a ramp; x lags by ERROR_M for ERROR_SAMPLES from each of its reversals on."""
    count = int(turns * 2.0 * np.pi * RADIUS_M / feed_m_s / PERIOD_S)
    speed = np.concatenate((np.linspace(0.0, feed_m_s, ramp, endpoint=False), np.full(count, feed_m_s)))
    angle = np.cumsum(speed) * PERIOD_S / RADIUS_M
    x, y = RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle)
    error = np.zeros_like(x)
    direction = np.sign(np.diff(x, prepend=2.0 * x[0] - x[1]))
    for start in np.flatnonzero(np.diff(direction)) + 1:
        error[start : start + ERROR_SAMPLES] = ERROR_M * direction[start]
    columns = {
        "time_s": np.arange(len(x)) * PERIOD_S,
        "segment": np.zeros(len(x), dtype=np.int32),
        "x.position_command_m": x,
        "y.position_command_m": y,
        "x.velocity_command_m_s": -speed * np.sin(angle),
        "y.velocity_command_m_s": speed * np.cos(angle),
        "x.scale_position_m": x - error,
        "y.scale_position_m": y,
    }
    header = {"axes": ["x", "y"], "segments": [{"label": "F 3000", "kind": "circle"}]}
    return Recording(Path("made by hand"), header, columns)


def test_indicators_of_a_known_error_are_those_of_the_hand_calculation() -> None:
    (result,) = analyse_circles(circle_recording(), WINDOW_S)
    x, y = result.indicators["x"], result.indicators["y"]
    share = ERROR_SAMPLES * PERIOD_S / WINDOW_S
    assert result.feed_mm_min == 3000
    assert result.radius_m == pytest.approx(RADIUS_M, rel=1e-9)
    assert x.error_peak_m == pytest.approx(ERROR_M)
    assert x.error_mean_m == pytest.approx(ERROR_M * share)
    assert x.error_rms_m == pytest.approx(ERROR_M * np.sqrt(share))
    # at its own reversal x points outwards: what x lags, the contour is off
    assert x.contour_peak_m == pytest.approx(ERROR_M, rel=0.01)
    assert y.error_peak_m == pytest.approx(0.0, abs=1e-15)


def test_the_error_trace_is_positive_where_the_table_lags_and_starts_at_the_reversal() -> None:
    (result,) = analyse_circles(circle_recording(), WINDOW_S)
    trace = result.error_traces["x"]
    inside = (trace.since_reversal_s > -0.5e-3) & (trace.since_reversal_s < (ERROR_SAMPLES - 0.5) * PERIOD_S)
    np.testing.assert_allclose(trace.error_m[inside], ERROR_M, rtol=1e-9)
    np.testing.assert_allclose(trace.error_m[~inside], 0.0, atol=1e-15)


def test_the_contour_trace_is_one_turn() -> None:
    (result,) = analyse_circles(circle_recording(), WINDOW_S)
    span = result.contour.angle_rad.max() - result.contour.angle_rad.min()
    assert span == pytest.approx(2.0 * np.pi, rel=1e-2)


def test_a_circle_that_is_no_whole_turn_is_refused() -> None:
    with pytest.raises(ValueError, match=r"less than one turn|no reversal"):
        analyse_circles(circle_recording(turns=0.8), WINDOW_S)


def test_published_figures_have_no_error_against_themselves() -> None:
    errors = relative_errors_percent(FENG_2015_X_UNCOMPENSATED)
    assert [value for row in errors.values() for value in row] == [0.0] * 16


def test_the_summary_counts_each_published_figure() -> None:
    figures = summary(analyse_circles(circle_recording(), WINDOW_S))
    ours = figures_um(analyse_circles(circle_recording(), WINDOW_S)[0].indicators["x"])
    theirs = FENG_2015_X_UNCOMPENSATED[3000]
    errors = [100.0 * (a / b - 1.0) for a, b in zip(ours, theirs, strict=True)]
    assert figures["relative_error_rms_percent"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert abs(figures["relative_error_largest_percent"]) == pytest.approx(max(np.abs(errors)))
