"""Computed channels, spectra, channel sets and event marks of the scope."""

from pathlib import Path

import numpy as np
import pytest
from stub_link import StubLink

from servo_ctrl.commands.bus_status import EventEntry
from servo_ctrl.hmi.charts.frames import PayloadCache
from servo_ctrl.hmi.scope.appearance import ScopeLayout, ShownChannel, scope_options
from servo_ctrl.hmi.scope.capture import CaptureSettings
from servo_ctrl.hmi.scope.channel_sets import FILE, SetsError, change_set, load_sets
from servo_ctrl.hmi.scope.controls import ScopeChoices, first_choices
from servo_ctrl.hmi.scope.event_marks import event_marks, marks_text
from servo_ctrl.hmi.scope.math_channels import ExpressionError, math_channel
from servo_ctrl.hmi.scope.set_controls import choices_of, set_of
from servo_ctrl.hmi.scope.spectrum import amplitude_spectrum, spectrum_figure
from servo_ctrl.hmi.scope.stream import CapturedRows, ScopeStream
from servo_ctrl.hmi.shell.plots import LIGHT
from servo_ctrl.hmi.shell.units import MM, DisplayUnit

NAMES = {"cycle": 0, "x.a_m": 1, "x.b_m": 2}
ROWS = np.array([[0.0, 0.0, 4.0], [1.0, 2.0, 9.0], [2.0, -4.0, np.nan]])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x.a_m * 1e3 - cycle", [1999.0, -4002.0]),
        ("abs(x.a_m) ** 2 [m^2]", [4.0, 16.0]),
        ("sqrt(x.b_m) / 0", [np.nan, np.nan]),
        ("d(x.a_m)", [20.0, -60.0]),
        ("max(x.a_m, 1) + min(-2, cycle)", [0.0, -1.0]),
        ("3", [3.0, 3.0]),
    ],
)
def test_an_expression_is_evaluated_row_by_row(text: str, expected: list[float]) -> None:
    found = math_channel(text, NAMES).values(ROWS, NAMES, 0.1)
    assert found == pytest.approx(expected, nan_ok=True)


def test_its_unit_stands_in_brackets() -> None:
    assert math_channel("x.a_m * 1e6 [\N{MICRO SIGN}m]", NAMES).unit == "\N{MICRO SIGN}m"
    assert math_channel("x.a_m", NAMES).unit == ""


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("__import__('os').system('true')", "are allowed"),
        ("x.a_m.__class__", "there is no channel"),
        ("[x for x in (1, 2)]", "are allowed"),
        ("lambda: 1", "are allowed"),
        ("x.a_m if 1 else 2", "are allowed"),
        ("'text'", "are allowed"),
        ("True", "are allowed"),
        ("y.a_m", "there is no channel y.a_m"),
        ("abs(x.a_m, 1)", "abs takes 1 values"),
        ("open(x.a_m)", "are allowed"),
        ("x.a_m +", "is not an expression"),
        ("1" + "+1" * 90, "too long"),
        ("(" * 150 + "1" + ")" * 150, "characters at most"),
    ],
)
def test_what_is_no_expression_over_channels_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ExpressionError, match=reason):
        math_channel(text, NAMES)


def test_a_computed_channel_is_the_same_however_the_rows_came() -> None:
    link = StubLink()
    channel = math_channel("d(x.position_command_m)", {name: k for k, name in enumerate(link.rows.names)})
    place = len(link.rows.names)
    stream = ScopeStream(PayloadCache())
    stream.settings, stream.columns = CaptureSettings(span=600), (place,)
    stream.compute([channel], link.hello.period_s)
    for count in (7, 300, 500):
        link.advance(count)
        stream.frame(link.rows)
    shown = stream.rows(link.rows)
    command_m = link.rows.since(shown.first - 1)[1][:, link.rows.place("x.position_command_m")]
    assert shown.values[:, place] == pytest.approx(np.diff(command_m) / link.hello.period_s)


def test_scale_and_offset_move_the_curve_and_its_level_and_are_shown() -> None:
    channel = ShownChannel("x.position_error_m", 3, MM.error, scale=10.0, offset=-2.0)
    layout = ScopeLayout(1.0, 0.0, {}, LIGHT, level=(channel.name, 0.5))
    options, [drawn] = scope_options([channel], layout, 1e-3)
    assert (drawn["fy"], drawn["oy"]) == (1e7, -2.0)
    assert options["legend"]["data"] == ["X following error \N{MULTIPLICATION SIGN}10 -2"]
    assert options["series"][0]["markLine"]["data"] == [{"yAxis": 3.0}]


def test_a_sine_has_a_line_of_its_amplitude_at_its_frequency() -> None:
    time_s = np.arange(2000) * 1e-3
    values = 5.0 + 0.3 * np.sin(2.0 * np.pi * 40.0 * time_s)
    values[100] = np.nan
    rate_hz, amplitude = amplitude_spectrum(values, 1e-3)
    assert rate_hz[np.argmax(amplitude)] == pytest.approx(40.0)
    assert amplitude.max() == pytest.approx(0.3, rel=0.01)
    assert not len(amplitude_spectrum(np.full(100, np.nan), 1e-3)[0])
    channel = ShownChannel("x.position_error_m", 0, DisplayUnit("\N{MICRO SIGN}m", 1e6, 2))
    long = np.random.default_rng(1).normal(size=(60_000, 1))
    assert len(spectrum_figure(long, [channel], 1e-3, LIGHT)["data"][0]["x"]) <= 1000


def test_a_set_is_kept_for_all_and_comes_back_as_it_was(tmp_path: Path) -> None:
    hello = StubLink().hello
    choices = first_choices(hello)
    choices.kind, choices.level, choices.adjusted = "rising", 2.0, {"x.position_error_m": (10.0, 1.0)}
    choices.limits, choices.expressions = {"y.position_error_m": (-1.0, 1.0)}, ["abs(x.position_error_m)"]
    change_set(tmp_path / "out", "errors", set_of(choices, "mm"))
    kept = load_sets(tmp_path / "out")
    assert choices_of(kept["errors"], "mm") == choices
    elsewhere = choices_of(kept["errors"], "um")
    assert (elsewhere.level, elsewhere.limits) == (2000.0, {})
    assert elsewhere.adjusted == {"x.position_error_m": (10.0, 0.0)}
    assert [channel.name for channel in elsewhere.shown_channels(hello, MM)][-1] == "abs(x.position_error_m)"
    assert change_set(tmp_path / "out", "errors", None) == {}


def test_a_broken_file_of_sets_is_named_and_not_overwritten(tmp_path: Path) -> None:
    for text in ("{", "[]", '{"format": 9, "sets": {}}', '{"sets": {"a": {"units": "ell", "channels": []}}}'):
        (tmp_path / FILE).write_text(text)
        with pytest.raises(SetsError, match=FILE):
            change_set(tmp_path, "a", set_of(ScopeChoices([]), "mm"))
        assert (tmp_path / FILE).read_text() == text
    with pytest.raises(SetsError, match="needs a name"):
        change_set(tmp_path, " ", None)


def test_events_within_the_picture_are_marked() -> None:
    values = np.array([[100.0], [101.0], [105.0], [106.0]])
    events = [EventEntry(cycle, f"event {cycle}", "") for cycle in (99, 101, 103, 106, 107)]
    marks = event_marks(events, CapturedRows(50, values), 51, 0, 0.001)
    assert [round(mark.at_s, 6) for mark in marks] == [0.0, 0.001, 0.002]
    assert marks_text(marks).splitlines()[0] == "1  cycle 101 event 101"
    assert event_marks(events, CapturedRows(0, values[:0]), 0, 0, 0.001) == []
