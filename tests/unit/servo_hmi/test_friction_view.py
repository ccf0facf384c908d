"""What the Friction page shows of reversals and learning."""

from pathlib import Path

import numpy as np
import pytest
from learned_examples import LEARNED, table_in
from stub_link import StubLink
from stub_status import first_status

from servo_ctrl.config.local_status import LearnedState
from servo_ctrl.hmi.friction_view import (
    INDICATORS,
    duration_text,
    error_figure,
    indicator_figure,
    indicators_of,
    newest_of_each,
    possible,
    progress_of,
)
from servo_ctrl.hmi.learned_view import (
    Drawn,
    amplitude_figure,
    before_use,
    duration_figure,
    from_state,
    screw_figure,
    version_rows,
)
from servo_ctrl.hmi.units import INCH, MM, UM
from servo_ctrl.learning.pulse_functions import amplitudes_m_s, durations_s
from servo_ctrl.telemetry.learned_store import LearnedStore, VersionEntry

FIRST = first_status()


@pytest.fixture
def link() -> StubLink:
    stub = StubLink()
    stub.advance(9_001)
    return stub


@pytest.mark.parametrize("indicator", INDICATORS)
def test_each_reversal_is_a_point_at_its_time(link: StubLink, indicator: str) -> None:
    figure = indicator_figure(link.reversals, ("x", "y"), indicator, 3e-6, 1e-3, MM, dark=False)
    for axis, curve in zip("xy", figure["data"], strict=True):
        seen = [one.report for one in link.reversals if one.axis == axis]
        assert seen
        assert curve["x"] == pytest.approx([report.cycle * 1e-3 for report in seen])
        assert curve["y"] == pytest.approx([getattr(report, indicator) * 1e6 for report in seen])
    assert ("shapes" in figure["layout"]) == (indicator == "error_mean_m")


def test_the_level_is_j_required_in_the_units_of_the_plot(link: StubLink) -> None:
    figure = indicator_figure(link.reversals, ("x",), "error_mean_m", 25.4e-6, 1e-3, INCH, dark=True)
    assert figure["layout"]["shapes"][0]["y0"] == pytest.approx(1000.0)
    assert "µin" in figure["layout"]["yaxis"]["title"]["text"]


def test_an_indicator_that_is_not_known_is_a_gap(link: StubLink) -> None:
    last = link.reversals[-1]
    blind = last.model_copy(update={"report": last.report.model_copy(update={"error_rms_m": None})})
    figure = indicator_figure([blind], ("x", "y"), "error_rms_m", None, 1e-3, MM, dark=False)
    assert [value for curve in figure["data"] for value in curve["y"]] == [None]


def test_the_last_error_of_each_axis_and_direction_is_drawn_over_milliseconds(link: StubLink) -> None:
    newest = newest_of_each(link.reversals)
    assert sorted((one.axis, one.report.direction) for one in newest) == [
        ("x", -1),
        ("x", 1),
        ("y", -1),
        ("y", 1),
    ]
    later = {(one.axis, one.report.direction): one.report.cycle for one in link.reversals}
    assert {(one.axis, one.report.direction): one.report.cycle for one in newest} == later
    curve = error_figure(newest, UM, dark=False)["data"][0]
    assert curve["x"][:3] == [0.0, 1.0, 2.0]
    assert curve["y"][0] == pytest.approx(5.0)


def test_only_j_can_be_above_j_required() -> None:
    axis = FIRST.axes[0]
    mean, *others = indicators_of(axis, 1e-6, MM)
    assert mean.above
    assert not any(indicator.above for indicator in others)
    assert not indicators_of(axis, 2e-6, MM)[0].above
    assert [one.text for one in indicators_of(axis.model_copy(update={"last": None}), 1e-6, MM)] == ["—"] * 4


@pytest.mark.parametrize(
    ("state", "commands"),
    [
        ("idle", {"start_learning"}),
        ("running", {"pause_learning", "abort_learning"}),
        ("pausing", {"resume_learning", "abort_learning"}),
        ("paused", {"resume_learning", "abort_learning"}),
        ("done", {"start_learning"}),
        ("aborted", {"start_learning"}),
        ("failed", {"start_learning"}),
    ],
)
def test_what_can_be_asked_follows_from_the_state(state: str, commands: set[str]) -> None:
    learning = FIRST.learning.model_copy(update={"state": state})
    assert {command for command, yes in possible(learning).items() if yes} == commands


def test_progress_stays_within_its_bar_and_says_nothing_of_what_is_unknown() -> None:
    learning = FIRST.learning.model_copy(update={"state": "running", "axis": "x", "progress": 1.2})
    progress = progress_of(learning, MM)
    assert (progress.share, progress.remaining, progress.best, progress.strokes) == (1.0, "", "", "")
    assert progress_of(FIRST.learning, MM).headline == "No learning run yet."


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(None, ""), (0.4, "0 s"), (59.6, "1 min 00 s"), (61.0, "1 min 01 s"), (3900.0, "1 h 05 min")],
)
def test_a_time_is_told_as_people_do(seconds: float | None, text: str) -> None:
    assert duration_text(seconds) == text


@pytest.mark.parametrize("spread", [0.0, 0.005])
def test_the_functions_are_drawn_as_the_control_law_reads_them(spread: float) -> None:
    learned = LEARNED._replace(spread_m_s2=spread)
    for make, function, factor in (
        (duration_figure, durations_s, 1e3),
        (amplitude_figure, amplitudes_m_s, 1e3),
    ):
        curve, points = make([Drawn("in use", learned)], MM, dark=False)["data"]
        at = np.array(curve["x"]) * 1e-3
        assert np.allclose(curve["y"], function(learned, at) * factor)
        assert len(points["x"]) == 4


def test_what_the_machine_says_it_uses_is_what_was_learned() -> None:
    state = LearnedState.model_validate({**LEARNED._asdict()})
    assert from_state(state) == LEARNED


def test_a_screw_is_drawn_when_it_has_a_table() -> None:
    figure = screw_figure(((0.0, 1e-6, 5e-6), (0.1, 2e-6, 6e-6)), MM, dark=False)
    assert figure is not None
    error, lost = figure["data"]
    assert error["x"] == pytest.approx([0.0, 100.0])
    assert (error["y"], lost["y"]) == (pytest.approx([1.0, 2.0]), pytest.approx([5.0, 6.0]))
    assert screw_figure((), MM, dark=False) is None


def test_versions_are_told_newest_first_with_what_is_wrong_with_them(tmp_path: Path) -> None:
    store = LearnedStore(tmp_path / "learned", table_in(tmp_path / "table"))
    for _ in range(3):
        store.add("x", LEARNED, {})
    damaged = tmp_path / "learned" / "x" / "v0002.json"
    damaged.write_text(damaged.read_text().replace("fast", "slow"))
    entries = store.versions("x")
    rows = version_rows(entries, MM)
    assert [(row.version, row.in_use) for row in rows] == [(3, True), (2, False), (1, False)]
    assert rows[0].gain == "5.25 → 1.12 µm"
    assert "checksum" in rows[1].problem
    assert before_use(entries) == 1
    kept = store.roll_back("x")
    assert kept is not None
    assert kept.version == 1
    assert before_use(store.versions("x")) == 0
    assert before_use([]) is None
    assert before_use([VersionEntry(1, in_use=False, result=None, problem="")]) is None
