"""Geometry of a part program: lines, arcs by radius and by centre, units, offsets."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from part_programs import MM, Read, elements, ends_mm, reader

from servo_ctrl.motion.path.path_move import Arc, PathMove


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> Read:
    return reader(tmp_path_factory.mktemp("nc"))


def angles(start: tuple[float, float], arc: Arc) -> tuple[float, float]:
    """Angle of the start and the signed sweep, by complex numbers."""
    centre = complex(*arc.centre_m)
    first, last = complex(*start) - centre, complex(arc.end_m[arc.axes[0]], arc.end_m[arc.axes[1]]) - centre
    turned = math.atan2((last / first).imag, (last / first).real)
    if abs(last - first) < 1e-12:
        turned = 0.0
    sense = 1.0 if arc.counterclockwise else -1.0
    sweep = turned if turned * sense > 0.0 else turned + sense * 2.0 * math.pi
    return math.atan2(first.imag, first.real), sweep


def test_positions_are_modal_and_absolute_or_incremental(read: Read) -> None:
    text = "G0 X1 Y2\nG1 X3 F60\nY4\nG91 X1 Y-1\nX.5\nG90 X0\nM2"
    assert ends_mm(read(text)) == [(1, 2), (3, 2), (3, 4), (4, 3), (4.5, 3), (0, 3)]


def test_an_inch_is_25_4_mm_in_positions_feeds_and_tolerances(read: Read) -> None:
    inch = read("G20 G64 P.001\nG0 X1 Y0\nG1 X2 Y.5 F10\nG2 X3 Y-.5 I.5 J-.5\nM2")
    metric = read("G21 G64 P.0254\nG0 X25.4 Y0\nG1 X50.8 Y12.7 F254\nG2 X76.2 Y-12.7 I12.7 J-12.7\nM2")
    for one, other in zip(inch.motion, metric.motion, strict=True):
        assert isinstance(one, PathMove)
        assert isinstance(other, PathMove)
        assert one.tolerance_m == pytest.approx(other.tolerance_m, rel=1e-12)
        for a, b in zip(one.elements, other.elements, strict=True):
            np.testing.assert_allclose(a.shape.end_m, b.shape.end_m, rtol=1e-12)
            assert a.feed_m_s == pytest.approx(b.feed_m_s, rel=1e-12)
            if isinstance(a.shape, Arc):
                assert isinstance(b.shape, Arc)
                np.testing.assert_allclose(a.shape.centre_m, b.shape.centre_m, rtol=1e-12, atol=1e-15)


def test_units_may_change_within_a_program_and_the_feed_stays(read: Read) -> None:
    program = read("G21 G0 X0 Y0\nG1 X10 F600\nG20 X1\nF1 Y1\nM2")
    assert ends_mm(program) == [(0, 0), (10, 0), (25.4, 0), (25.4, 25.4)]
    assert [element.feed_m_s for element in elements(program)][1:] == pytest.approx(
        [0.01, 0.01, 25.4e-3 / 60.0]
    )


def test_rapids_have_no_feed_of_their_own(read: Read) -> None:
    program = read("G1 F600 X0 Y0\nG0 X10\nG1 X20\nM2")
    assert [element.feed_m_s for element in elements(program)] == [0.01, math.inf, 0.01]


def test_the_work_offset_shifts_absolute_positions_and_centres_alone(read: Read) -> None:
    text = "G54 G0 X1 Y2\nG2 X3 Y2 I1 J0 F60\nG91 G1 X1\nM2"
    plain, shifted = read(text), read(text, work_offset_mm={"x": 10.0, "y": -5.0})
    np.testing.assert_allclose(np.array(ends_mm(shifted)) - ends_mm(plain), [[10.0, -5.0]] * 3)
    arc = elements(shifted)[1].shape
    assert isinstance(arc, Arc)
    assert arc.centre_m == pytest.approx((12.0 * MM, -3.0 * MM))


def test_axes_that_are_not_named_stay_where_they_are(read: Read) -> None:
    program = read("G0 Z5 X1\nG1 X2 F60\nM2", "xyz")
    ends = [element.shape.end_m for element in elements(program)]
    np.testing.assert_array_equal(ends, [[0.001, math.nan, 0.005], [0.002, math.nan, 0.005]])


@given(
    st.floats(-50.0, 50.0),
    st.floats(-50.0, 50.0),
    st.floats(0.5, 80.0),
    st.floats(0.0, 2.0 * math.pi),
    st.floats(0.05, 2.0 * math.pi - 0.05).filter(lambda sweep: abs(sweep - math.pi) > 0.01),
    st.booleans(),
)
def test_arcs_by_radius_and_by_centre_are_the_same_arc(
    read: Read, x: float, y: float, radius: float, angle: float, sweep: float, ccw: bool
) -> None:
    """Written with many digits, so that what is left is the geometry."""
    turned = sweep if ccw else -sweep
    start = x + radius * math.cos(angle), y + radius * math.sin(angle)
    end = x + radius * math.cos(angle + turned), y + radius * math.sin(angle + turned)
    signed = radius if sweep < math.pi else -radius
    word = "G3" if ccw else "G2"
    head = f"G0 X{start[0]:.12f} Y{start[1]:.12f}\n{word} X{end[0]:.12f} Y{end[1]:.12f} F600 "
    for centre in (f"R{signed:.12f}", f"I{x - start[0]:.12f} J{y - start[1]:.12f}"):
        _, element = elements(read(head + centre + "\nM2"))
        arc = element.shape
        assert isinstance(arc, Arc)
        np.testing.assert_allclose(arc.centre_m, (x * MM, y * MM), atol=1e-9)
        found_angle, found_sweep = angles((start[0] * MM, start[1] * MM), arc)
        assert math.cos(found_angle - angle) == pytest.approx(1.0, abs=1e-9)
        assert found_sweep == pytest.approx(turned, abs=1e-6)


@pytest.mark.parametrize(("word", "sense"), [("G2", -1.0), ("G3", 1.0)])
def test_a_full_circle_ends_where_it_begins(read: Read, word: str, sense: float) -> None:
    for text in (f"{word} I-5 F60", f"{word} X10 Y0 I-5 J0 F60", f"G91 {word} X0 Y0 I-5 F60"):
        _, element = elements(read(f"G0 X10 Y0\n{text}\nM2"))
        assert isinstance(element.shape, Arc)
        assert element.shape.end_m == pytest.approx((10 * MM, 0.0), abs=1e-15)
        assert angles((10 * MM, 0.0), element.shape)[1] == pytest.approx(sense * 2.0 * math.pi)


@pytest.mark.parametrize("decimals", [3, 4])
def test_arcs_with_rounded_coordinates_are_accepted(read: Read, decimals: int) -> None:
    """Three decimals of a millimetre and four of an inch, arcs of all sizes and lengths."""
    rng = np.random.default_rng(5)
    unit, units = (MM, "G21") if decimals == 3 else (25.4 * MM, "G20")
    rounding_m = 2.0 * math.hypot(0.5, 0.5) * 10**-decimals * unit  # of the start and of the centre
    for _ in range(200):
        radius, x, y = rng.uniform(0.1, 60.0) * MM / unit, *(rng.uniform(-40.0, 40.0, 2) * MM / unit)
        angle, sweep = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.1, 2.0 * math.pi - 0.1)
        start = x + radius * math.cos(angle), y + radius * math.sin(angle)
        end = x + radius * math.cos(angle + sweep), y + radius * math.sin(angle + sweep)
        numbers = [f"{value:.{decimals}f}" for value in (*start, *end, x - start[0], y - start[1])]
        sx, sy, ex, ey, i, j = numbers
        first, second = elements(read(f"{units} G0 X{sx} Y{sy}\nG3 X{ex} Y{ey} I{i} J{j} F60\nM2"))
        arc = second.shape
        assert isinstance(arc, Arc)
        assert arc.end_m == pytest.approx((float(ex) * unit, float(ey) * unit), abs=1e-15)
        assert math.dist(arc.centre_m, (x * unit, y * unit)) < rounding_m
        turned = angles((first.shape.end_m[0], first.shape.end_m[1]), arc)[1]
        assert turned == pytest.approx(sweep, abs=4.0 * rounding_m / (radius * unit))


def test_a_radius_that_rounding_made_too_small_is_a_half_circle(read: Read) -> None:
    arc = elements(read("G0 X0 Y0\nG2 X10.001 Y0 R5 F60\nM2"))[1].shape
    assert isinstance(arc, Arc)
    assert arc.centre_m == pytest.approx((5.0005 * MM, 0.0))


def test_a_helix_moves_the_third_axis_with_the_angle(read: Read) -> None:
    (_, element) = elements(read("G0 X10 Y0 Z0\nG3 X-10 Y0 Z4 I-10 F60\nM2", "xyz"))
    assert isinstance(element.shape, Arc)
    assert element.shape.end_m == pytest.approx((-10 * MM, 0.0, 4 * MM))
    assert element.shape.axes == (0, 1)


@pytest.mark.parametrize(
    ("plane", "axes", "start", "end", "centre"),
    [
        ("G17", (0, 1), "X5 Y0 Z0", "X0 Y5", "I-5 J0"),
        ("G18", (2, 0), "Z5 X0 Y0", "Z0 X5", "K-5 I0"),
        ("G19", (1, 2), "Y5 Z0 X0", "Y0 Z5", "J-5 K0"),
    ],
)
def test_each_plane_turns_from_its_first_axis_to_its_second(
    read: Read, plane: str, axes: tuple[int, int], start: str, end: str, centre: str
) -> None:
    for by in (centre, "R5"):
        arc = elements(read(f"{plane} G0 {start}\nG3 {end} {by} F60\nM2", "xyz"))[1].shape
        assert isinstance(arc, Arc)
        assert (arc.axes, arc.counterclockwise) == (axes, True)
        assert arc.centre_m == pytest.approx((0.0, 0.0), abs=1e-12)
