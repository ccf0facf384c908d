"""What cards of the operator show, without a browser: events, lines around the one under way, states."""

from pathlib import Path

import pytest
from stub_status import first_status

from servo_ctrl.commands.bus_status import EventEntry
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.part_program import ReadingOptions
from servo_ctrl.hmi.drive.events_card import events_csv, matching_events
from servo_ctrl.hmi.friction.figures import outliers
from servo_ctrl.hmi.friction.page import median_error_m, requirement_text
from servo_ctrl.hmi.motion.program_run import lines_around, step_text
from servo_ctrl.hmi.motion.programs import preview_of
from servo_ctrl.hmi.shell.machine_stage import shown_stage
from servo_ctrl.hmi.shell.units import MM

EVENTS = tuple(
    EventEntry(cycle, text, time="2026-11-24T09:00:00+00:00")
    for cycle, text in ((1, "axis X: done"), (5, 'axis y: "slow", done'), (9, "enabled"))
)
MACHINE = Path(__file__).parents[3] / "machines" / "xy_table" / "controller.toml"


def test_events_are_filtered_by_words_put_aside_and_written_as_a_table() -> None:
    assert [event.cycle for event in matching_events(EVENTS, "DONE axis", -1)] == [1, 5]
    assert [event.cycle for event in matching_events(EVENTS, "", 5)] == [9]
    assert events_csv(EVENTS[1:2]).splitlines() == [
        "time,cycle,event",
        '2026-11-24T09:00:00+00:00,5,"axis y: ""slow"", done"',
    ]


def test_the_line_under_way_stands_among_its_neighbours() -> None:
    text = "\n".join(f"G1 X{number}" for number in range(1, 10))
    shown = lines_around(text, 2)
    assert [(number, here) for number, _text, here in shown] == [
        (1, False),
        (2, True),
        *((n, False) for n in (3, 4, 5)),
    ]
    assert shown[1][1] == "G1 X2"
    assert lines_around(text, 0) == lines_around(text, 10) == ()


def test_a_hold_shows_its_reason_and_a_single_line_is_named_as_one() -> None:
    program = first_status().program._replace(
        step=2, label="line 7", line=7, held=True, held_by="single block"
    )
    assert step_text(program, Stage.RUNNING) == 'held in step 3 "line 7", line 7 (single block)'
    apart = program._replace(held=False, held_by="", apart=True)
    assert step_text(apart, Stage.RUNNING) == 'a line of its own "line 7", line 7'


def test_the_large_j_is_the_median_and_an_odd_last_one_is_named() -> None:
    recent_m = [1e-6, 1.1e-6, 1.1e-6, 9e-6]
    assert median_error_m(recent_m, 9e-6) == pytest.approx(1.1e-6)
    text = requirement_text(recent_m, 9e-6, 3e-6, MM.error)
    assert text == "J, median of the last 4; required 3.00 µm; the last one is an outlier: 9.00 µm"
    assert requirement_text(recent_m[:3], 1e-6, 1e-6, MM.error).endswith(
        "required 1.00 µm \N{EM DASH} above it"
    )
    assert median_error_m(recent_m[:2], 5e-6) == 5e-6
    assert requirement_text(recent_m[:2], 5e-6, 3e-6, MM.error) == "J; required 3.00 µm \N{EM DASH} above it"


def test_odd_reversals_are_marked_in_the_chart() -> None:
    assert outliers([1.0, 1.1, None, 0.9, 5.0, 1.0]) == [False, False, False, False, True, False]
    assert outliers([9.0, 1.0]) == [False, False]


def test_nodes_that_are_set_up_again_are_a_state_of_their_own() -> None:
    status = first_status()._replace(stage=Stage.STANDBY, reason="it was lost", setting_up=True)
    assert shown_stage(status).word == "Setting up nodes"
    assert shown_stage(status._replace(setting_up=False)).word == "Fault"


def test_a_preview_is_read_with_the_work_offsets_and_shows_where_the_path_is_entered() -> None:
    text = "G0 X0 Y0\nG1 X1 F600\nY1\nM2\n"
    reading = ReadingOptions(work_offsets_m={"G54": {"x": 0.005}}, first_line=3)
    preview = preview_of(MACHINE, "part.ngc", text, reading)
    assert preview.entry is not None
    assert preview.entry.position_m == (0.006, 0.0)
    assert preview.position_m[-1].round(9).tolist() == [0.006, 0.001]
