"""Figures of the report show the simulated effects, and lose no peak."""

import base64

import numpy as np
import plotly.graph_objects as go
import pytest
from formula_residuals import N, T

from reconcile.location.residual_analysis import ResidualAnalysis
from reconcile.replay.model_replays import ReplayComparison
from reconcile.report.figures import figures
from reconcile.report.replay_figures import replay_figures
from reconcile.report.traces import peaks
from servo_ctrl.recording.min_max import thinned
from servo_ctrl.report.html_file import packed


def test_held_out_stretches_are_shaded_and_the_floor_is_drawn(views: list[ResidualAnalysis]) -> None:
    over_time = figures(views[0], 500)[0]
    shaded = [shape for shape in over_time.layout["shapes"] if shape["fillcolor"] == "--held-out"]
    assert [(shape["x0"], shape["x1"]) for shape in shaded] == [pytest.approx((0.75 * N * T, (N - 1) * T))]
    bands = [shape for shape in over_time.layout["shapes"] if shape["fillcolor"] == "--floor-band"]
    assert bands[0]["y1"] == pytest.approx(2.0 * views[0].floor.rms)


def test_the_ripple_stands_in_the_order_spectrum_and_is_gone_after(views: list[ResidualAnalysis]) -> None:
    picture = next(one for one in figures(views[0], 500) if one.name == "orders")
    (x, before), (_, after) = (
        tuple(np.frombuffer(base64.b64decode(trace[axis]["bdata"]), "<f4") for axis in "xy")
        for trace in picture.data
    )
    assert x[before.argmax()] == pytest.approx(1.0, abs=0.05)
    assert after.max() < 0.3 * before.max()


def test_the_replay_is_drawn_where_the_nominal_model_errs_most(replayed: list[ReplayComparison]) -> None:
    picture = replay_figures(replayed, 5000)["x"]
    x, recorded, before, after = (
        np.frombuffer(base64.b64decode(trace[axis]["bdata"]), "<f4")
        for trace, axis in zip((picture.data[0], *picture.data[:3]), "xyyy", strict=True)
    )
    assert x[-1] - x[0] == pytest.approx(4.0, abs=0.01)
    assert x[0] <= 12.0
    assert x[-1] + T >= 14.0
    assert (before - recorded).max() == pytest.approx(3.0, abs=1e-4)
    assert np.abs(after - recorded).max() == pytest.approx(0.3, abs=1e-4)


def test_the_gap_between_the_directions_is_the_backlash(views: list[ResidualAnalysis]) -> None:
    picture = next(one for one in figures(views[1], 500) if one.name == "scale-less-motor")
    forwards, backwards = (
        np.frombuffer(base64.b64decode(trace["y"]["bdata"]), "<f4") for trace in picture.data
    )
    assert np.median(backwards) - np.median(forwards) == pytest.approx(3.0, abs=0.2)


def test_no_peak_is_lost_where_a_series_is_cut() -> None:
    rng = np.random.default_rng(0)
    x, y = np.arange(1.0, 100_001.0), rng.normal(size=100_000)
    y[[777, 50_001]] = 40.0, -30.0
    short_x, short_y = thinned(x, y, 300)
    assert len(short_y) <= 600
    assert (short_y.max(), short_y.min()) == (40.0, -30.0)
    assert (np.diff(short_x) > 0.0).all()
    top_x, top_y = peaks(x, np.abs(y), 300)
    assert len(top_y) <= 301
    assert (top_y.max(), top_x[top_y.argmax()]) == (40.0, 778.0)
    assert np.isnan(thinned(x, np.where(x > 5e4, np.nan, y), 300)[1]).any()


def test_arrays_are_packed_as_plotly_reads_them() -> None:
    trace = go.Scatter(y=packed(np.array([1.0, -2.5, np.nan])))
    assert np.frombuffer(base64.b64decode(trace.to_plotly_json()["y"]["bdata"]), "<f4")[:2].tolist() == [
        1.0,
        -2.5,
    ]
