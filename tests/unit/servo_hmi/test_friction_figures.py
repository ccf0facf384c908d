"""What the Friction page shows of reversals and learning."""

import math
from pathlib import Path

import numpy as np
import pytest
from learned_examples import LEARNED, table_in
from stub_link import StubLink
from stub_status import first_status
from waveform_examples import SAMPLES, example_waveform

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.objections import objection
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.friction.figures import (
    INDICATORS,
    MEAN,
    error_figure,
    indicator_figure,
    newest_of_each,
    pulse_figure,
    roll_back_target,
    screw_figure,
    version_rows,
    waveform_figure,
)
from servo_ctrl.hmi.friction.learning_card import BUTTONS, FIGURES, learning_figures
from servo_ctrl.hmi.shell.plots import DARK, LIGHT, Look
from servo_ctrl.hmi.shell.units import INCH, MM, UM, duration_text
from servo_ctrl.learned.store import LearnedStore, VersionEntry
from servo_ctrl.learning.pulse_functions import amplitudes_m_s, durations_s

FIRST = first_status()


@pytest.fixture
def link() -> StubLink:
    stub = StubLink()
    stub.advance(9_001)
    return stub


@pytest.mark.parametrize("indicator", INDICATORS)
def test_each_reversal_is_a_point_at_its_time(link: StubLink, indicator: str) -> None:
    figure = indicator_figure(link.reversals, ("x", "y"), indicator, 3e-6, Look(MM, LIGHT))
    for axis, curve in zip("xy", figure["data"], strict=True):
        seen = [one.report for one in link.reversals if one.axis == axis]
        assert seen
        assert curve["x"] == pytest.approx([report.cycle * 1e-3 for report in seen])
        assert curve["y"] == pytest.approx([getattr(report, indicator) * 1e6 for report in seen])
    assert ("shapes" in figure["layout"]) == (indicator == "error_mean_m")


def test_the_level_is_j_required_in_the_units_of_the_plot(link: StubLink) -> None:
    figure = indicator_figure(link.reversals, ("x",), MEAN, 25.4e-6, Look(INCH, DARK))
    assert figure["layout"]["shapes"][0]["y0"] == pytest.approx(1000.0)
    assert "µin" in figure["layout"]["yaxis"]["title"]["text"]


def test_an_indicator_that_is_not_known_is_a_gap(link: StubLink) -> None:
    last = link.reversals[-1]
    blind = last._replace(report=last.report._replace(error_rms_m=math.nan))
    figure = indicator_figure([blind], ("x", "y"), "error_rms_m", 3e-6, Look(MM, LIGHT))
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
    curve = error_figure(newest, Look(UM, LIGHT))["data"][0]
    assert curve["x"][:3] == [0.0, 1.0, 2.0]
    assert curve["y"][0] == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("state", "commands"),
    [
        (LearningState.IDLE, {Command.START_LEARNING}),
        (LearningState.RUNNING, {Command.PAUSE_LEARNING, Command.ABORT_LEARNING}),
        (LearningState.PAUSING, {Command.RESUME_LEARNING, Command.ABORT_LEARNING}),
        (LearningState.PAUSED, {Command.RESUME_LEARNING, Command.ABORT_LEARNING}),
        (LearningState.DONE, {Command.START_LEARNING}),
        (LearningState.ABORTED, {Command.START_LEARNING}),
        (LearningState.FAILED, {Command.START_LEARNING}),
    ],
)
def test_possible_commands_follow_from_the_state(state: LearningState, commands: set[Command]) -> None:
    status = FIRST._replace(stage=Stage.READY, learning=FIRST.learning._replace(state=state))
    assert {command for command in BUTTONS if not objection(status, command)} == commands


def test_unknown_figures_of_learning_are_empty() -> None:
    learning = FIRST.learning._replace(state=LearningState.RUNNING, axis="x", strokes_done=6)
    assert set(learning_figures(learning, MM)) == set(FIGURES)
    assert not any(learning_figures(learning, MM).values())


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(math.nan, ""), (0.4, "0 s"), (59.6, "1 min 00 s"), (61.0, "1 min 01 s"), (3900.0, "1 h 05 min")],
)
def test_durations_have_hours_minutes_and_seconds(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


@pytest.mark.parametrize("spread", [0.0, 0.005])
def test_the_functions_are_drawn_as_the_control_law_reads_them(spread: float) -> None:
    learned = LEARNED._replace(spread_m_s2=spread)
    for part, function in (("durations", durations_s), ("amplitudes", amplitudes_m_s)):
        curve, points = pulse_figure({"in use": learned}, part, Look(MM, LIGHT))["data"]
        at = np.array(curve["x"]) * 1e-3
        assert np.allclose(curve["y"], function(learned, at) * 1e3)
        assert len(points["x"]) == 4


def test_a_waveform_is_drawn_as_force_over_the_time_around_the_reversal() -> None:
    learned = example_waveform()
    first, second = waveform_figure(learned, 1e-3, Look(MM, LIGHT))["data"]
    assert (first["name"], second["name"]) == ("50.0 mm/s²", "400.0 mm/s²")
    assert first["x"][:2] == pytest.approx([-30.0, -29.0])
    assert first["y"] == list(learned.waves_n[0])
    assert len(first["y"]) == SAMPLES
    assert waveform_figure(None, 1e-3, Look(MM, LIGHT))["data"] == []


def test_a_screw_is_drawn_when_it_has_a_table() -> None:
    figure = screw_figure(((0.0, 1e-6, 5e-6), (0.1, 2e-6, 6e-6)), Look(MM, LIGHT))
    error, lost = figure["data"]
    assert error["x"] == pytest.approx([0.0, 100.0])
    assert (error["y"], lost["y"]) == (pytest.approx([1.0, 2.0]), pytest.approx([5.0, 6.0]))
    assert screw_figure((), Look(MM, LIGHT))["data"] == []


def test_versions_are_listed_newest_first_with_their_problems(tmp_path: Path) -> None:
    store = LearnedStore(tmp_path / "learned", table_in(tmp_path / "table"))
    for _ in range(3):
        store.add("x", LEARNED, {})
    damaged = tmp_path / "learned" / "x" / "v0002.json"
    damaged.write_text(damaged.read_text().replace("fast", "slow"))
    entries = store.versions("x")
    rows = version_rows(entries, MM)
    assert [row["name"] for row in rows] == ["3, in use", "2", "1"]
    assert rows[0]["gain"] == "5.25 → 1.12 µm"
    assert "checksum" in rows[1]["problem"]
    assert roll_back_target(entries) == 1
    kept = store.roll_back("x")
    assert kept is not None
    assert kept.version == 1
    assert roll_back_target(store.versions("x")) == 0
    assert roll_back_target([]) is None
    assert roll_back_target([VersionEntry(1, in_use=False, result=None, problem="")]) is None
