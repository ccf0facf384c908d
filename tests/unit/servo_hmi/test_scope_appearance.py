"""Panes by unit, scales by channel, and a refresh interval that grows with the lag of the loop."""

from servo_ctrl.cyclic.cia402 import DriveState
from servo_ctrl.cyclic.drive_phases import PHASE_TEXTS
from servo_ctrl.hmi.charts.live_chart import LONGEST_S, SHORTEST_S, next_interval
from servo_ctrl.hmi.scope.appearance import ScopeLayout, ShownChannel, channel_unit, panes_of, scope_options
from servo_ctrl.hmi.shell.channel_names import (
    DRIVE_STATES,
    PHASES,
    TITLES,
    channel_small_print,
    channel_title,
)
from servo_ctrl.hmi.shell.plots import LIGHT
from servo_ctrl.hmi.shell.units import INCH, MM
from servo_ctrl.recording.channels import AXIS_CHANNELS, MACHINE_CHANNELS

NAMES = (("x.position_command_m", "m"), ("x.position_error_m", "m"), ("x.velocity_command_m_s", "m/s"))
LAYOUT = ScopeLayout(span_s=1.0, before_s=0.25, cursors={"A": 0.1, "B": 0.2}, theme=LIGHT)


def channels() -> list[ShownChannel]:
    return [ShownChannel(name, k, channel_unit(name, unit, MM)) for k, (name, unit) in enumerate(NAMES)]


def test_each_unit_has_its_pane_and_errors_one_apart_from_positions() -> None:
    assert panes_of(channels()) == ["mm", "\N{MICRO SIGN}m", "mm/s"]


def test_channels_have_the_units_of_the_system() -> None:
    assert channel_unit("x.position_command_m", "m", INCH).with_unit(0.0254) == "1.00000 in"
    assert channel_unit("x.statusword", "1", INCH).unit == ""


def test_time_begins_before_the_trigger_and_every_channel_has_its_array() -> None:
    options, drawn = scope_options(channels(), LAYOUT, 1e-3)
    assert {(axis["min"], axis["max"]) for axis in options["xAxis"]} == {(-250.0, 750.0)}
    assert [(trace["y"], trace["fx"], trace["fy"]) for trace in drawn] == [
        (1, 1.0, 1e3),
        (2, 1.0, 1e6),
        (3, 1.0, 1e3),
    ]
    cursors = [series for series in options["series"] if str(series["id"]).startswith("cursors")]
    assert [[mark["xAxis"] for mark in series["markLine"]["data"]] for series in cursors] == [
        [100.0, 200.0]
    ] * 3


def test_a_channel_with_a_fixed_scale_has_an_axis_of_its_own() -> None:
    chosen = channels()
    chosen[1] = chosen[1]._replace(limits=(-5.0, 5.0))
    options, _ = scope_options(chosen, LAYOUT, 1e-3)
    series = options["series"][1]
    assert (options["yAxis"][series["yAxisIndex"]]["min"], options["yAxis"][series["yAxisIndex"]]["max"]) == (
        -5.0,
        5.0,
    )
    assert options["yAxis"][series["yAxisIndex"]]["gridIndex"] == series["xAxisIndex"] == 1


def test_the_interval_grows_while_the_loop_lags_and_recovers() -> None:
    interval = SHORTEST_S
    for _ in range(100):
        interval = next_interval(interval, 2.0 * interval)
    assert interval == LONGEST_S
    for _ in range(200):
        interval = next_interval(interval, interval)
    assert interval == SHORTEST_S


def test_time_is_zoomed_in_all_panes_together() -> None:
    options, _drawn = scope_options(channels(), LAYOUT, 1e-3)
    assert [zoom["xAxisIndex"] for zoom in options["dataZoom"]] == [[0, 1, 2]] * 2
    assert {zoom["filterMode"] for zoom in options["dataZoom"]} == {"none"}, "no point is dropped"


def test_every_channel_and_every_state_of_a_drive_has_an_operators_words() -> None:
    assert set(TITLES) == {channel.name for channel in (*MACHINE_CHANNELS, *AXIS_CHANNELS)}
    assert set(DRIVE_STATES) == {state.value for state in DriveState}
    assert set(PHASES) == set(PHASE_TEXTS.values())
    assert channel_title("x.position_error_m") == "X following error"
    small = channel_small_print("x.position_error_m")
    assert small == "following error actual value, 60F4h; x.position_error_m"
    assert channel_title("x.of_a_later_version") == "x.of_a_later_version"
