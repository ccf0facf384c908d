"""Paths of lines and arcs: within the limits for any program, true to the geometry, and fast."""

import math

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st
from path_moves import STILL, TABLE, T, curve, duration, limits, path, path_violation, run

from servo_ctrl.motion.path.path_move import Arc, Element, Line, PathMove, plan_path, true_geometry
from servo_ctrl.motion.profile import MotionLimits


@st.composite
def programs(draw: st.DrawFn) -> tuple[PathMove, MotionLimits]:
    """A few lines, arcs and helices of any size, feed, tolerance and stops."""
    axes = draw(st.integers(1, 3))
    sizes = st.sampled_from([1e-6, 1e-4, 2e-3, 3e-2])
    coordinate = st.builds(lambda size, share: size * share, sizes, st.floats(-1.0, 1.0))
    of = limits(
        *(
            [draw(st.floats(low, 20.0 * low)) for _ in range(axes)]
            for low in (0.02, 0.5, draw(st.sampled_from([5.0, 200.0])))
        )
    )
    elements, at_m = [], np.zeros(axes)
    for number in range(draw(st.integers(1, 8))):
        end_m = at_m + [draw(coordinate) for _ in range(axes)]
        shape: Line | Arc = Line(tuple(end_m))
        if axes > 1 and draw(st.booleans()):
            first, second = draw(st.permutations(range(axes)))[:2]
            plane = [first, second]
            chord = end_m[plane] - at_m[plane]
            # through both ends, or about any place with an end that is not quite on the circle
            off = draw(st.floats(-3.0, 3.0)) * np.array([-chord[1], chord[0]])
            centre = 0.5 * (at_m[plane] + end_m[plane]) + off
            if draw(st.booleans()):
                end_m[plane] = at_m[plane]
                centre = at_m[plane] + [draw(coordinate), draw(coordinate)]
            shape = Arc(tuple(end_m), tuple(centre), (first, second), draw(st.booleans()))
        feed = draw(st.one_of(st.floats(0.01, 0.3), st.just(math.inf)))
        elements.append(Element(shape, feed, number, draw(st.integers(0, 5)) == 0))
        at_m = end_m
    tolerance = draw(st.sampled_from([0.0, 1e-8, 1e-6, 1e-5, 1e-3]))
    return PathMove("p", tuple(elements), tolerance), of


@given(programs())
@settings(deadline=None, max_examples=60)
def test_no_program_leaves_the_limits_or_its_tolerance(program: tuple[PathMove, MotionLimits]) -> None:
    step, of = program
    start = np.zeros(len(of.force_n))
    assert path_violation(step, of) is None
    plan = plan_path(step, start, of, T)
    motion = plan.profile.at(np.linspace(0.0, plan.profile.duration_s, 2000))
    distance_m, _ = true_geometry(step, start)(motion.position_m)
    assert distance_m.max() <= max(step.tolerance_m, 1e-9) + 1e-12
    feeds = np.array([element.feed_m_s for element in step.elements])
    speed = np.linalg.norm(motion.velocity_m_s, axis=1)
    assert speed.max() <= feeds.max() * (1 + 1e-9)
    wanted = [value for value in step.elements[-1].shape.end_m if not math.isnan(value)]
    assert list(plan.profile.end_m) == wanted
    assert list(motion.position_m[-1]) == wanted


@pytest.mark.parametrize(
    ("distance", "feed"),
    [(1e-6, 0.2), (1e-3, 0.2), (0.02, 0.2), (0.3, 0.2), (0.3, 0.01)],
    ids=["jerk only", "jerk and a little more", "no cruise", "cruise", "slow cruise"],
)
def test_a_straight_move_is_as_fast_as_time_optimal_control(distance: float, feed: float) -> None:
    asked = ruckig.InputParameter(1)
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [feed], [2.0], [50.0]
    asked.target_position = [distance]
    optimal = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(asked, optimal)
    took_s = duration(path(Line((distance, 0.0)), feed=feed))
    assert optimal.duration * (1 - 1e-9) <= took_s <= optimal.duration * (1 + 1e-5)


def test_a_line_cut_into_many_is_run_as_one() -> None:
    whole = path(Line((0.05, 0.03)), feed=0.1)
    cut = path(*(Line((0.05 * k / 400, 0.03 * k / 400)) for k in range(1, 401)), feed=0.1, tolerance=0.0)
    assert duration(cut) == pytest.approx(duration(whole), rel=1e-6)


def test_velocity_acceleration_and_jerk_are_successive_derivatives() -> None:
    step = path(
        Line((0.01, 0.0)), Arc((0.02, 0.01), (0.01, 0.01), (0, 1), True), Line((0.0, 0.02)), tolerance=1e-4
    )
    time_s, (x, v, a, offset) = run(step, instants=100_001)
    dt = time_s[1]
    # Simpson's sums, exact for a cubic
    np.testing.assert_allclose(
        (x[2:] - x[:-2])[::2], dt / 3 * (v[:-2] + 4 * v[1:-1] + v[2:])[::2], atol=1e-13
    )
    np.testing.assert_allclose((v[2:] - v[:-2])[::2], dt / 3 * (a[:-2] + 4 * a[1:-1] + a[2:])[::2], atol=1e-9)
    assert not offset.any()


def test_a_circle_is_round_at_its_feed() -> None:
    step = path(Arc((0.0, 0.0), (-0.025, 0.0), (0, 1), False))
    time_s, motion = run(step)
    np.testing.assert_allclose(
        np.hypot(motion.position_m[:, 0] + 0.025, motion.position_m[:, 1]), 0.025, atol=1e-15
    )
    assert motion.position_m[100, 1] < 0.0
    inside = (time_s > 0.1) & (time_s < time_s[-1] - 0.1)
    np.testing.assert_allclose(np.hypot(*motion.velocity_m_s[inside].T), 0.05, rtol=1e-12)
    # 2 pi R / F, and the time that the ramps cost: v / a + a / j with nearly the whole 2 m/s^2
    assert time_s[-1] == pytest.approx(math.pi + 0.025 + 0.04, abs=0.01)


def test_a_helix_climbs_in_proportion_to_its_angle() -> None:
    of = limits((0.2,) * 3, (2.0,) * 3, (50.0,) * 3)
    _, motion = run(path(Arc((0.0, 0.0, 0.01), (0.01, 0.0), (0, 1), True)), of)
    x, y, z = motion.position_m.T
    angle = np.unwrap(np.arctan2(-y, 0.01 - x))
    np.testing.assert_allclose(z, 0.01 * angle / math.tau, atol=1e-14)


def test_the_same_program_gives_the_same_bits() -> None:
    step = curve(0.01, 2e-4, 200, 5)
    first, second = run(step)[1], run(step)[1]
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_each_sample_belongs_to_an_element() -> None:
    step = path(Line((0.01, 0.0)), Line((0.01, 0.0)), Line((0.01, 0.01)), stops=[0])
    plan = plan_path(step, np.zeros(2), TABLE, T)
    time_s = np.linspace(0.0, plan.profile.duration_s, 501)
    y = plan.profile.at(time_s).position_m[:, 1]
    np.testing.assert_array_equal(plan.element_at(time_s)[1:] == 2, y[1:] > 0.0)
    assert plan.length_m == pytest.approx(0.02)


def test_axes_that_are_not_named_stay_and_a_path_of_no_length_takes_no_time() -> None:
    _, motion = run(path(Line((STILL, 0.01)), Line((0.01, STILL)), tolerance=0.0))
    assert motion.position_m[-1].tolist() == [0.01, 0.01]
    assert duration(path(Line((0.0, 0.0)), Line((STILL, STILL)))) == 0.0


def test_distance_is_to_the_nearest_point_of_the_path() -> None:
    rng = np.random.default_rng(5)
    shapes: list[Line | Arc] = []
    at, dense = np.zeros(3), []
    share = np.linspace(0.0, 1.0, 2001)[:, np.newaxis]
    for number in range(12):
        if number % 3:
            end = at + rng.normal(size=3) * 0.01
            shapes.append(Line(tuple(end)))
            dense.append(at + (end - at) * share)
        else:
            # an arc of the plane y, z, every second one a helix along x
            turn = rng.uniform(-6.0, 6.0)
            centre = at[1:] + rng.normal(size=2) * 0.005
            arm = at[1:] - centre
            angle = turn * share
            around = np.hstack(
                (
                    at[0] + (number % 2) * 0.003 * share,
                    centre[0] + np.cos(angle) * arm[0] - np.sin(angle) * arm[1],
                    centre[1] + np.sin(angle) * arm[0] + np.cos(angle) * arm[1],
                )
            )
            end = around[-1]
            shapes.append(Arc(tuple(end), tuple(centre), (1, 2), turn > 0.0))
            dense.append(around)
        at = end
    points = rng.normal(size=(300, 3)) * 0.03
    found_m, element = true_geometry(path(*shapes), np.zeros(3))(points)
    each = np.array([np.linalg.norm(points[:, np.newaxis] - part, axis=2).min(axis=1) for part in dense])
    np.testing.assert_allclose(found_m, each.min(axis=0), rtol=1e-4)
    np.testing.assert_allclose(each[element, np.arange(len(points))], found_m, rtol=1e-4)
