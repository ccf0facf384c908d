"""The words of the operator's page: pure functions of a status."""

import math
from pathlib import Path

import pytest
from stub_status import TIME, first_status

from servo_ctrl.commands.bus_status import EventEntry
from servo_ctrl.commands.learning_status import LearningState, LearningStatus
from servo_ctrl.commands.machine_status import DriveStatus, MachineStatus, ProgramStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.contour.turns import LETTERS
from servo_ctrl.hmi.drive.axis_card import homed_text, position_unknown
from servo_ctrl.hmi.drive.faults import COMPUTER_BUSY, advice_for_reason, faults_in
from servo_ctrl.hmi.friction.learning_card import headline
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.motion.program_run import step_text
from servo_ctrl.hmi.shell.event_texts import coalesced, reason_text, when
from servo_ctrl.hmi.shell.machine_stage import shown_stage
from servo_ctrl.hmi.shell.overload import RecentShare, overload_text
from servo_ctrl.hmi.shell.units import UNIT_SYSTEMS
from studies.feng_2015.variants import OBSERVER, PULSE, WITHOUT

ROOT = Path(__file__).parents[3]
SILENT = "axis.x.drive (node 1): no heartbeat in 300 cycles"


def with_fields(**fields: object) -> MachineStatus:
    return first_status()._replace(**fields)


def drive(phase: str, *, homed: bool = True) -> DriveStatus:
    return first_status().drives[0]._replace(phase=phase, homed=homed)


@pytest.mark.parametrize(
    ("status", "word"),
    [
        (with_fields(stage=Stage.RUNNING), "Running"),
        (with_fields(stage=Stage.RUNNING, program=ProgramStatus(held=True)), "Held"),
        (with_fields(stage=Stage.RUNNING, learning=LearningStatus(LearningState.RUNNING, "x")), "Learning"),
        (
            with_fields(stage=Stage.READY, learning=LearningStatus(LearningState.PAUSED, "x")),
            "Learning paused",
        ),
        (with_fields(stage=Stage.STARTING, drives=(drive("homing"),)), "Homing"),
        (with_fields(stage=Stage.STARTING, drives=(drive("switching on"),)), "Switching on"),
        (with_fields(stage=Stage.STOPPING), "Stopping"),
        (with_fields(stage=Stage.READY), "Ready"),
    ],
)
def test_what_the_machine_does_is_a_state_of_its_own(status: MachineStatus, word: str) -> None:
    assert shown_stage(status).word == word


def test_axes_under_control_without_a_program_can_be_jogged_and_each_state_has_its_own_sign() -> None:
    jogging = shown_stage(with_fields(stage=Stage.RUNNING), jogged=True)
    assert jogging.word == "Jogging"
    held = shown_stage(with_fields(stage=Stage.RUNNING, program=ProgramStatus(held=True)))
    running = shown_stage(with_fields(stage=Stage.RUNNING, program=ProgramStatus(step=0)), jogged=True)
    assert running.word == "Running"
    assert shown_stage(first_status(), jogged=True).word == "Ready"
    assert len({shown.sign for shown in (jogging, held, running)}) == 3
    assert held.tone != running.tone


def test_missed_ticks_are_the_first_cause_of_a_silent_node() -> None:
    overloaded = with_fields(stage=Stage.STANDBY, reason=SILENT, cycles=160_000, missed_ticks=82_020)
    first, second = faults_in(overloaded)
    assert (first.where, first.advice) == ("Computer", COMPUTER_BUSY)
    assert "82020 of 160000" in first.detail
    assert "simulator" in first.advice.remedy
    assert second.advice is advice_for_reason(SILENT)
    quiet = overloaded._replace(missed_ticks=10)
    assert [fault.where for fault in faults_in(quiet)] == ["Machine"]


def test_the_banner_shows_the_share_of_the_newest_ticks_and_disappears_when_they_arrive() -> None:
    ticks = RecentShare()
    assert ticks.take(with_fields(cycles=0, missed_ticks=0)) == 0.0
    share = ticks.take(with_fields(cycles=4000, missed_ticks=2000))
    assert "50 %" in overload_text(share)
    for cycles in range(5000, 14_000, 1000):
        share = ticks.take(with_fields(cycles=cycles, missed_ticks=2000))
    assert overload_text(share) == ""
    assert ticks.take(with_fields(cycles=10, missed_ticks=0)) == 0.0


def test_a_lost_axis_is_neither_homed_nor_somewhere() -> None:
    assert homed_text(drive("lost")) == homed_text(None) == "position unknown"
    assert position_unknown(drive("lost"))
    assert not position_unknown(drive("servo"))
    assert (homed_text(drive("servo")), homed_text(drive("off", homed=False))) == ("homed", "not homed")


def test_events_that_differ_in_numbers_only_are_one_with_a_count() -> None:
    texts = ("12 ticks were missed", "7 ticks were missed", "axis x: done", "3 ticks were missed")
    shown = coalesced([EventEntry(cycle, text) for cycle, text in enumerate(texts)])
    assert [(event.cycle, count) for event, count in shown] == [(1, 2), (2, 1), (3, 1)]
    axes = coalesced([EventEntry(0, "node axis.x1 lost"), EventEntry(1, "node axis.x2 lost")])
    assert len(axes) == 2


def test_a_group_of_events_that_comes_again_is_one_with_counts() -> None:
    lost = [f"node {node}: no heartbeat" for node in ("x", "y")]
    texts = ["enable", *lost, "9 ticks", *lost, "8 ticks", "7 ticks", *lost, "6 ticks", lost[0]]
    shown = coalesced([EventEntry(cycle, text) for cycle, text in enumerate(texts)])
    assert [(event.text, count) for event, count in shown] == [
        ("enable", 1),
        (lost[0], 3),
        (lost[1], 3),
        ("6 ticks", 4),
        (lost[0], 1),
    ]


def test_a_stop_names_who_and_when() -> None:
    stopped = EventEntry(8, "quick stop by the operator", TIME)
    status = with_fields(stage=Stage.STANDBY, reason=stopped.text, events=(stopped,))
    assert reason_text(status) == f"{stopped.text}, at {when(stopped)}"
    assert when(stopped).count(":") == 2
    assert reason_text(status._replace(events=())) == stopped.text
    asked = EventEntry(7, "anna (operate, 192.0.2.7): quick_stop", TIME)
    by_anna = reason_text(status._replace(events=(asked, stopped)))
    assert by_anna == f"quick stop by anna (operate, 192.0.2.7), at {when(stopped)}"
    assert when(EventEntry(1234, "no clock")) == "cycle 1\N{THIN SPACE}234"


def test_finished_learning_reports_when_the_requirement_is_not_reached() -> None:
    units = UNIT_SYSTEMS["mm"]
    done = LearningStatus(LearningState.DONE, "x", best_m=7.4e-6)
    assert headline(done, 3e-6, units).startswith(
        "Axis x: done, requirement not reached: J 7.40 µm, required 3.00 µm."
    )
    assert headline(done._replace(best_m=2e-6), 3e-6, units) == "Axis x: done"
    assert headline(done._replace(best_m=math.nan), 3e-6, units) == "Axis x: done"
    assert headline(LearningStatus(), 3e-6, units) == "No learning run yet."


def test_a_program_can_be_started_only_where_the_controller_would_start_it() -> None:
    loaded = ProgramStatus(name="a.toml", loaded=True)
    assert step_text(loaded, Stage.READY) == "can be started"
    assert "Enable" in step_text(loaded, Stage.STANDBY)
    assert "load it" in step_text(ProgramStatus(), Stage.READY)


def test_page_study_and_documents_use_the_letters_of_the_paper_alike() -> None:
    assert LETTERS == {"without": WITHOUT, "pulse": PULSE, "observer": OBSERVER}
    study = (ROOT / "docs/friction_study.md").read_text()
    assert f"**{WITHOUT}** is without compensation" in study
    assert f"**{PULSE}** with the learned pulse" in study
    page = " ".join((ROOT / "docs/operator_page.md").read_text().split())
    assert f"without compensation ({WITHOUT}), with the learned pulse ({PULSE})" in page
    assert f"with the disturbance observer ({OBSERVER})" in page


def test_messages_of_the_controller_are_shown_with_the_signs_of_their_units() -> None:
    text = controller_text("axis y: J 7.6 um over 4.0 um at 140 mm/s^2; the column um")
    assert text == "axis y: J 7.6 µm over 4.0 µm at 140 mm/s²; the column um"
