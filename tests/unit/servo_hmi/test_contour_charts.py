"""The charts of the last turns are made once for all pages that display the same."""

import numpy as np
import pytest
from stub_link import TURN_S, StubLink

from servo_ctrl.commands.machine_status import ContourStatus
from servo_ctrl.hmi.charts.live_chart import on_drawn
from servo_ctrl.hmi.contour.options import polar_points
from servo_ctrl.hmi.contour.page import coupling_text
from servo_ctrl.hmi.contour.turn_charts import MAX_CACHED, TurnCharts, TurnDisplay, common_range, turn_charts
from servo_ctrl.hmi.contour.turn_store import TurnStore
from servo_ctrl.hmi.shell.plots import DARK, LIGHT, Look
from servo_ctrl.hmi.shell.units import INCH, MM

AXES = ("x", "y")


@pytest.fixture(scope="module")
def store() -> TurnStore:
    """After a turn of the stub's circle."""
    link = StubLink()
    link.advance(round(1.3 * TURN_S * 1e3))
    made = TurnStore()
    made.search(link.rows, AXES)
    assert made.circles()
    return made


def display_of(store: TurnStore, **changed: object) -> TurnDisplay:
    display = TurnDisplay(store.circles()[0], 1000.0, fitted=False, axes=AXES, look=Look(MM, LIGHT))
    return display._replace(**changed)  # type: ignore[arg-type]


def charts_of(store: TurnStore, **changed: object) -> TurnCharts | None:
    return turn_charts(store, store.version, display_of(store, **changed))


def test_ten_pages_with_one_display_make_the_charts_once(store: TurnStore) -> None:
    shown = [charts_of(store) for _ in range(10)]
    assert all(one is shown[0] for one in shown)


@pytest.mark.parametrize(
    "changed", [{"factor": 500.0}, {"fitted": True}, {"look": Look(INCH, LIGHT)}, {"look": Look(MM, DARK)}]
)
def test_another_display_makes_other_charts(store: TurnStore, changed: dict[str, object]) -> None:
    one, other = (charts_of(store, **change) for change in ({}, changed))
    assert one is not None
    assert other is not None
    assert (one.polar.options, one.polar.frame, one.description) != (
        other.polar.options,
        other.polar.frame,
        other.description,
    )


def test_a_new_turn_makes_new_charts_and_an_unknown_circle_has_none(store: TurnStore) -> None:
    before = charts_of(store)
    store.version += 1
    assert charts_of(store) is not before
    assert charts_of(store, circle=(1, 2, 1)) is None


def test_the_points_are_those_of_the_turn(store: TurnStore) -> None:
    picture = charts_of(store)
    assert picture is not None
    [turn] = store.turns(store.circles()[0])
    sent = np.frombuffer(picture.polar.frame.payload).reshape(picture.polar.arrays, -1)
    np.testing.assert_array_equal(sent, polar_points(turn.trace, turn, 1000.0))


def test_the_panes_of_the_quadrants_have_one_scale_which_holds_every_error(store: TurnStore) -> None:
    picture = charts_of(store)
    assert picture is not None
    options = picture.quadrants.options
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


def test_the_cache_is_bounded(store: TurnStore) -> None:
    for factor in range(1, 3 * MAX_CACHED):
        charts_of(store, factor=float(factor))
    assert turn_charts.cache_info().currsize == MAX_CACHED


@pytest.mark.parametrize(
    "arguments", [(), ("nobody", 1, 1), (None, 1, 1), ("x", "y", "z"), (1, 2, 3, 4), ({}, [], 1.5)]
)
def test_an_invalid_acknowledgement_is_ignored(arguments: tuple[object, ...]) -> None:
    on_drawn("socket", *arguments)


def test_contour_control_is_named_only_where_it_couples_axes() -> None:
    assert coupling_text(ContourStatus(), MM) == ""
    assert coupling_text(ContourStatus(AXES), MM).endswith("X, Y: contour error now \N{EM DASH}.")
    assert coupling_text(ContourStatus(AXES, -1.2e-6), INCH).endswith("\N{MINUS SIGN}47 µin.")
