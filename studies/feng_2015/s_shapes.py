"""S1-S4 of Feng et al. 2015, there and back on one axis: indicators and error traces at the reversals."""

from typing import NamedTuple

from servo_ctrl.learning.performance import combined, indicators, window_samples
from servo_ctrl.metrology.circles import ReversalFigures, error_trace, figures_um
from servo_ctrl.plots.contour_traces import ErrorTrace
from servo_ctrl.recording.reader import Recording


class SShapeResult(NamedTuple):
    """Indicators and error trace of one motion."""

    name: str
    axis: str
    figures: ReversalFigures
    """With one axis in motion the contour error is the tracking error."""
    error_trace: ErrorTrace


def analyse_s_shapes(recording: Recording, axis_of: dict[str, str], window_s: float) -> list[SShapeResult]:
    """Analyse the motions of a recording; `axis_of` maps their labels to axes, `window_s` is Tm.

    Raises:
        ValueError: a motion without a whole reversal.
        RecordingError: a motion that is not in the recording.

    """
    period_s = float(recording.header["period_s"])
    results = []
    for name, axis in axis_of.items():
        columns = recording.segment(name)
        command_m, scale_m = columns[f"{axis}.position_command_m"], columns[f"{axis}.scale_position_m"]
        error_m = command_m - scale_m
        entries = indicators(command_m, scale_m, error_m, window_samples(window_s, period_s))
        if not entries:
            raise ValueError(f"{name}: no reversal of {axis} with its whole monitoring time")
        trace = error_trace(name, error_m, command_m, period_s, window_s)
        results.append(SShapeResult(name, axis, figures_um(combined(entries)), trace))
    return results
