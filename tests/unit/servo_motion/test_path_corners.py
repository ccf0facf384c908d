"""Corners of paths: cut by no more than the tolerance and the feed need; smooth joints are not corners."""

import math

import numpy as np
import pytest
from path_moves import TABLE, curve, duration, path, path_violation, run

from servo_ctrl.motion.path.path_move import Arc, Line, true_geometry

CORNER = np.array([0.02, 0.0])
AROUND = (Line((0.02, 0.0)), Line((0.02, 0.02)))
SHARP = (Line((0.02, 0.0)), Line((0.0, 0.005)))


@pytest.mark.parametrize(
    ("shapes", "tolerance", "feed"),
    [
        (AROUND, 1e-5, 0.005),
        (AROUND, 1e-4, 0.03),
        (AROUND, 5e-4, 0.1),
        (SHARP, 1e-5, 0.004),
        (SHARP, 1e-4, 0.016),
    ],
)
def test_a_fast_corner_uses_most_of_the_tolerance_and_never_exceeds_it(
    shapes: tuple[Line, ...], tolerance: float, feed: float
) -> None:
    _, motion = run(path(*shapes, feed=feed, tolerance=tolerance))
    cut_m = np.linalg.norm(motion.position_m - CORNER, axis=1).min()
    assert 0.8 * tolerance < cut_m <= tolerance


def test_a_slow_corner_is_cut_no_more_than_its_feed_needs() -> None:
    cuts = []
    for feed in (1e-3, 2e-3):
        _, motion = run(path(*AROUND, feed=feed, tolerance=1e-3))
        cuts.append(np.linalg.norm(motion.position_m - CORNER, axis=1).min())
        speed = np.linalg.norm(motion.velocity_m_s, axis=1)
        # in its middle both axes have half the feed
        assert speed[2000:-2000].min() == pytest.approx(feed * math.sqrt(0.5), rel=1e-3)
    assert cuts[1] < 1e-5
    # the jerk of the corner grows as v^3 / h^2
    assert cuts[1] / cuts[0] == pytest.approx(2**1.5, rel=0.02)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-5, 1e-4, 1e-3])
def test_rounding_costs_no_more_time_than_stopping(tolerance: float) -> None:
    square = [Line((0.05, 0.0)), Line((0.05, 0.05)), Line((0.0, 0.05)), Line((0.0, 0.0))]
    rounded = duration(path(*square, tolerance=tolerance))
    assert rounded <= duration(path(*square, tolerance=0.0))
    if tolerance == 1e-3:
        assert rounded < duration(path(*square, tolerance=1e-4)) < duration(path(*square, tolerance=0.0))


def test_the_axes_rest_at_every_exact_stop_and_nowhere_else() -> None:
    step = path(*AROUND, Line((0.0, 0.02)), Line((0.0, 0.0)), tolerance=1e-3, stops=[1])
    _, motion = run(step)
    speed = np.linalg.norm(motion.velocity_m_s, axis=1)
    to_stop = np.linalg.norm(motion.position_m - [0.02, 0.02], axis=1)
    assert to_stop.min() < 1e-9
    slow = speed < 1e-4
    assert to_stop[slow & (np.linalg.norm(motion.position_m, axis=1) > 1e-6)].max() < 1e-6
    stopped = path(*AROUND, Line((0.0, 0.02)), Line((0.0, 0.0)), tolerance=0.0)
    _, motion = run(stopped)
    for corner in ([0.02, 0.0], [0.02, 0.02], [0.0, 0.02]):
        assert np.linalg.norm(motion.position_m - corner, axis=1).min() < 1e-9


def test_a_tangent_arc_is_entered_without_a_stop_whatever_the_tolerance() -> None:
    shapes = (Line((0.05, 0.0)), Arc((0.05, 0.05), (0.05, 0.025), (0, 1), True), Line((0.0, 0.05)))
    for tolerance, slowest, beside_m in ((0.0, 0.02, 1e-9), (1e-5, 0.0495, 1e-7)):
        step = path(*shapes, tolerance=tolerance)
        time_s, motion = run(step)
        inside = (time_s > 0.2) & (time_s < time_s[-1] - 0.2)
        assert np.hypot(*motion.velocity_m_s[inside].T).min() > slowest
        assert true_geometry(step, np.zeros(2))(motion.position_m)[0].max() < beside_m


@pytest.mark.parametrize(("decimals", "slower"), [(12, 1.02), (6, 1.05)], ids=["exact", "whole micrometres"])
def test_short_lines_are_run_nearly_as_the_curve_that_they_draw(decimals: int, slower: float) -> None:
    step = curve(0.05, 1e-4, 2000, decimals)
    arc = Arc((0.05 * math.sin(4.0), 0.05 * (1 - math.cos(4.0))), (0.0, 0.05), (0, 1), True)
    assert duration(step) < slower * duration(path(arc))
    assert path_violation(step, TABLE) is None
    _, motion = run(step)
    assert true_geometry(step, np.zeros(2))(motion.position_m)[0].max() <= 1e-5
