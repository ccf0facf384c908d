"""What the Contour pages show of the last turns is made once for all that look at the same."""

from __future__ import annotations

import numpy as np
import pytest
from stub_link import TURN_S, StubLink

from servo_ctrl.hmi.contour_pictures import KEPT_PICTURES, Look, Pictures, common_range
from servo_ctrl.hmi.contour_view import polar_points
from servo_ctrl.hmi.contour_watch import ContourWatch
from servo_ctrl.hmi.live_chart import on_drawn
from servo_ctrl.hmi.units import SYSTEMS

AXES = ("x", "y")


@pytest.fixture(scope="module")
def watch() -> ContourWatch:
    """After a turn of the stub's circle."""
    link = StubLink()
    link.advance(round(1.3 * TURN_S * 1e3))
    made = ContourWatch()
    made.look(link.rows, AXES)
    assert made.circles()
    return made


def look_of(watch: ContourWatch, **changed: object) -> Look:
    look = Look(watch.circles()[0], 1000.0, fitted=False, axes=AXES, units=SYSTEMS["mm"], dark=False)
    return look._replace(**changed)  # type: ignore[arg-type]


def test_ten_pages_that_look_at_the_same_cost_one(watch: ContourWatch) -> None:
    pictures = Pictures(watch)
    shown = [pictures.picture(look_of(watch)) for _ in range(10)]
    assert pictures.made == 1
    assert all(one is shown[0] for one in shown)


@pytest.mark.parametrize(
    "changed", [{"factor": 500.0}, {"fitted": True}, {"units": SYSTEMS["inch"]}, {"dark": True}]
)
def test_another_look_is_another_picture(watch: ContourWatch, changed: dict[str, object]) -> None:
    pictures = Pictures(watch)
    one, other = (pictures.picture(look_of(watch, **change)) for change in ({}, changed))
    assert one is not None
    assert other is not None
    assert (one.polar.drawn, one.polar.frame, one.about) != (
        other.polar.drawn,
        other.polar.frame,
        other.about,
    )


def test_a_new_turn_is_a_new_picture_and_a_circle_that_was_not_run_is_none(watch: ContourWatch) -> None:
    pictures = Pictures(watch)
    before = pictures.picture(look_of(watch))
    watch.version += 1
    assert pictures.picture(look_of(watch)) is not before
    assert pictures.picture(look_of(watch, circle=(1, 2, 1))) is None


def test_the_points_are_those_of_the_turn(watch: ContourWatch) -> None:
    picture = Pictures(watch).picture(look_of(watch))
    assert picture is not None
    [turn] = watch.turns(watch.circles()[0])
    sent = np.frombuffer(picture.polar.frame.payload).reshape(picture.polar.arrays, -1)
    np.testing.assert_array_equal(sent, polar_points(turn.trace, turn, 1000.0))


def test_the_panes_of_the_quadrants_have_one_scale_which_holds_every_error(watch: ContourWatch) -> None:
    picture = Pictures(watch).picture(look_of(watch))
    assert picture is not None
    options, _ = picture.quadrants.drawn
    (limits,) = {(axis["min"], axis["max"]) for axis in options["yAxis"]}
    errors_um = np.frombuffer(picture.quadrants.frame.payload).reshape(8, -1)[1::2] * 1e6
    assert limits[0] <= np.nanmin(errors_um) < np.nanmax(errors_um) <= limits[1]
    assert limits[1] - limits[0] < 4.0 * np.nanmax(np.abs(errors_um))


@pytest.mark.parametrize("error_m", [0.0, 3e-6, -3e-6])
def test_a_scale_is_round_and_never_empty(error_m: float) -> None:
    low, high = common_range([np.array([[0.0, 1.0], [error_m, error_m]])], 1e6)
    assert low <= min(error_m * 1e6, 0.0)
    assert high > max(error_m * 1e6, 0.0) or high >= error_m * 1e6 > 0.0
    assert common_range([np.zeros((2, 0))], 1e6)[0] < common_range([], 1e6)[1]


def test_only_so_many_pictures_are_kept(watch: ContourWatch) -> None:
    pictures = Pictures(watch)
    for factor in range(1, 3 * KEPT_PICTURES):
        pictures.picture(look_of(watch, factor=float(factor)))
    assert len(pictures._kept) == KEPT_PICTURES


@pytest.mark.parametrize(
    "told", [(), ("nobody", 1, 1), (None, 1, 1), ("x", "y", "z"), (1, 2, 3, 4), ({}, [], 1.5)]
)
def test_what_no_chart_of_ours_has_drawn_is_nothing(told: tuple[object, ...]) -> None:
    on_drawn("socket", *told)
