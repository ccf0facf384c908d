"""S-shaped motions of a synthetic recording: a known error after the reversal of y."""

from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.recording.reader import Recording
from servo_ctrl.recording.recorder import RecordingError
from studies.feng_2015.s_shapes import analyse_s_shapes

PERIOD_S, WINDOW_S, ERROR_M, ERROR_SAMPLES = 1e-3, 0.2, 8e-6, 60


def recording(turns_back: bool = True) -> Recording:
    """S1 rises for a second and comes back, lagging by ERROR_M for ERROR_SAMPLES; S2 by half of it."""
    time_s = np.arange(2000) * PERIOD_S
    command = 0.01 * np.sin(0.5 * np.pi * time_s) if turns_back else 0.01 * time_s
    error = np.zeros_like(command)
    start = int(np.argmax(command)) + 1
    error[start : start + ERROR_SAMPLES] = -ERROR_M
    columns = {
        "segment": np.repeat([0, 1], 2000),
        "y.position_command_m": np.tile(command, 2),
        "y.scale_position_m": np.concatenate((command - error, command - 0.5 * error)),
    }
    header = {"axes": ["y"], "period_s": PERIOD_S, "segments": [{"label": "S1"}, {"label": "S2"}]}
    return Recording(Path("made by hand"), header, columns)


def test_indicators_of_a_known_error_are_those_of_the_hand_calculation() -> None:
    first, second = analyse_s_shapes(recording(), {"S1": "y", "S2": "y"}, WINDOW_S)
    share = ERROR_SAMPLES * PERIOD_S / WINDOW_S
    assert first.figures == pytest.approx((8.0, 8.0 * share, 8.0, 8.0 * np.sqrt(share)), rel=1e-6)
    assert second.figures == pytest.approx([0.5 * value for value in first.figures], rel=1e-6)


def test_the_error_trace_is_positive_where_the_axis_lags() -> None:
    (result,) = analyse_s_shapes(recording(), {"S1": "y"}, WINDOW_S)
    trace = result.error_trace
    assert trace.label == "S1"
    at_once = np.searchsorted(trace.since_reversal_s, 0.5 * PERIOD_S)
    assert trace.error_m[at_once : at_once + ERROR_SAMPLES - 1] == pytest.approx(ERROR_M)


def test_a_motion_without_a_reversal_or_not_in_the_recording_is_named() -> None:
    with pytest.raises(ValueError, match="S1: no reversal of y"):
        analyse_s_shapes(recording(turns_back=False), {"S1": "y"}, WINDOW_S)
    with pytest.raises(RecordingError, match="'S3'"):
        analyse_s_shapes(recording(), {"S3": "y"}, WINDOW_S)
