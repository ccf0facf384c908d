"""A friction study with preset values: indicators of every variant, and learned pulses."""

from pathlib import Path

import numpy as np

from servo_ctrl.learning.performance import Indicators
from servo_ctrl.learning.types import Learned, Pulse, Stroke
from servo_ctrl.metrology.circles import CircleResult, ReversalFigures
from servo_ctrl.plots.contour_traces import ContourTrace, ErrorTrace
from studies.feng_2015.s_shapes import SShapeResult
from studies.feng_2015.strokes import RepeatedStroke
from studies.feng_2015.study import FrictionStudy, cells
from studies.feng_2015.twin_learning import LearnedAxis, TwinLearning, TwinStroke
from studies.feng_2015.variants import VariantResult
from studies.feng_2015.waveform_study import WaveformStudy

STROKE = Stroke("coarse", 0.008, Pulse(0.1, 0.0004))
WITHOUT_UM = (20.0, 6.0, 20.0, 10.0)
"""Contour peak, mean, peak, RMS without compensation."""
WAVEFORM_UM = ReversalFigures(0.5, 0.1, 0.5, 0.2)


def learned(after_m: float = 0.8e-6, strokes: int = 1600) -> Learned:
    return Learned(
        learner="paper",
        durations=((0.002, 0.19), (0.12, 0.035)),
        amplitudes=((0.002, 0.0002), (0.12, 0.0016)),
        spread_m_s2=0.001,
        trailing=((0.002, 0.1, 0.05, -1e-4), (0.12, 0.05, 0.03, -2e-4)),
        before_m=6e-6,
        after_m=after_m,
        strokes=strokes,
        machine_time_s=28_800.0,
    )


def trace(label: str) -> ErrorTrace:
    time_s = np.arange(-50, 300) * 1e-3
    return ErrorTrace(label, time_s, 1e-5 * np.exp(-np.abs(time_s) / 0.05))


def _indicators(figures_um: tuple[float, ...]) -> Indicators:
    contour, mean, peak, rms = (value * 1e-6 for value in figures_um)
    return Indicators(
        reversal=0, direction=1, contour_peak_m=contour, error_peak_m=peak, error_rms_m=rms, error_mean_m=mean
    )


def variant(share: float, feeds: tuple[int, ...] = (500, 3000)) -> VariantResult:
    """Return a variant whose indicators are this share of those without compensation."""
    figures = tuple(value * share for value in WITHOUT_UM)
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    circles = [
        CircleResult(
            label=f"F {feed}",
            feed_mm_min=feed,
            radius_m=0.025,
            indicators={axis: _indicators(figures) for axis in ("x", "y")},
            error_traces={axis: trace(f"F {feed}") for axis in ("x", "y")},
            contour=ContourTrace(f"F {feed}", angle, 1e-5 * share * np.cos(angle)),
        )
        for feed in feeds
    ]
    return VariantResult(circles, [SShapeResult("S1", "y", ReversalFigures(*figures), trace("S1"))], 8.0)


def twin(after_m: float, strokes: int) -> TwinLearning:
    axis = LearnedAxis(learned(after_m, strokes), [TwinStroke(STROKE, 1e-6)], 60.0)
    return TwinLearning(Path("store"), {"x": axis, "y": axis}, 61.0)


def study(pulse: float = 0.15, observer: float = 0.6) -> FrictionStudy:
    """Return a study; `pulse`, `observer`: shares of the errors that remain with them."""
    results = {
        "WTFC": variant(1.0),
        "WDOB": variant(observer),
        "WFC": variant(pulse),
        "WFC_single": variant(0.5),
    }
    repeated = [RepeatedStroke("x", STROKE, 1e-6, 1e-6)]
    by_waveform = {(cell.group, cell.label): WAVEFORM_UM for cell in cells(results)}
    return FrictionStudy(
        results=results,
        paper=twin(0.8e-6, 1600),
        fast=twin(0.7e-6, 65),
        repeated=repeated,
        seed=2015,
        bus=None,
        wall_s=200.0,
        processor_s=250.0,
        waveforms=WaveformStudy(by_waveform, {}, [{"name": "observer"}], 20.0),
    )
