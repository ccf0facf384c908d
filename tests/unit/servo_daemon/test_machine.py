"""The machine through its stages, with ideal drives (CSP, no dynamics, no delay)."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ideal_drives import AWAY, COUNT_M, PERIOD_S, Stand, ideal_machine_file

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.program import program_segments
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.motion.move import Dwell
from servo_ctrl.motion.program import Segment


@pytest.fixture
def stand(tmp_path: Path) -> Callable[..., Stand]:
    path = ideal_machine_file(tmp_path)
    return lambda **options: Stand(path, **options)


def test_axes_are_switched_on_and_the_program_is_requested_once(stand: Callable[..., Stand]) -> None:
    made = stand().run(60)
    assert (made.machine.stage, made.ready) == (Stage.READY, 1)
    assert [drive.statusword for drive in made.drives] == [0x0227, 0x0227]


def test_program_is_run_to_its_end_and_the_drives_are_switched_off(stand: Callable[..., Stand]) -> None:
    made = stand().start().run(2000)
    machine = made.machine
    assert (machine.stage, machine.completed, machine.failed, machine.reason) == (Stage.OFF, True, False, "")
    assert made.positions_m() == pytest.approx([0.002, 0.001], abs=COUNT_M)
    assert [drive.statusword for drive in made.drives] == [0x0240, 0x0240]
    segments = [row[2] for row in made.rows]
    assert sorted(set(segments)) == [-1, 0, 1]
    assert segments == sorted(segments[:-3]) + [-1] * 3


def test_machine_without_a_program_holds_where_it_is(stand: Callable[..., Stand]) -> None:
    made = stand()
    made.drives[0].position = 12345
    made.run(200)
    assert made.machine.stage is Stage.READY
    assert made.drives[0].position == 12345


EVENTS_WHILE_RUNNING = [
    (Event.STOP_SIGNAL, Stage.STOPPING, False),
    (Event.EMCY, Stage.STOPPING, True),
    (Event.LOST_HEARTBEAT, Stage.STOPPING, True),
    (Event.FOLLOWING_ERROR, Stage.QUICK_STOPPING, True),
    (Event.BUS_DOWN, Stage.DISABLING, True),
]


@pytest.mark.parametrize(("event", "stage", "failed"), EVENTS_WHILE_RUNNING)
def test_event_leads_to_its_stop_and_then_off(
    stand: Callable[..., Stand], event: Event, stage: Stage, failed: bool
) -> None:
    made = stand().start()
    made.machine.event(event, "because")
    assert made.machine.stage is stage
    made.run(2000)
    assert (made.machine.stage, made.machine.failed, made.machine.reason) == (Stage.OFF, failed, "because")
    assert made.faults == ([(event, "because")] if failed else [])
    assert [drive.statusword for drive in made.drives] == [0x0240, 0x0240]


def test_the_first_reason_stands_and_all_events_are_logged(stand: Callable[..., Stand]) -> None:
    made = stand().start()
    for event, text in ((Event.EMCY, "first"), (Event.EMCY, "second"), (Event.EMCY, "first")):
        made.machine.event(event, text)
    assert (made.machine.reason, made.machine.events.kept) == ("first", ["first", "second"])
    assert made.faults == [(Event.EMCY, "first")]


def test_drive_fault_stops_the_other_axis_too(stand: Callable[..., Stand]) -> None:
    made = stand().start()
    made.drives[1].statusword = 0x0208
    made.run(2000)
    assert (made.machine.stage, made.machine.reason) == (Stage.OFF, "axis y: the drive is in fault")
    commands = np.array([row[3] for row in made.rows])
    assert np.abs(np.diff(commands[np.isfinite(commands)], 2)).max() <= 2.0 * PERIOD_S**2 * 1.001
    assert made.drives[0].statusword == 0x0240


def test_non_finite_set_point_makes_the_drives_brake(stand: Callable[..., Stand]) -> None:
    """A ramp of ours would have to start from it."""
    made = stand().run(60)
    broken = Segment(0, "broken", "move", *(np.full((9, 2), np.nan) for _ in range(4)), 0, (0, 0))
    made.machine.run(ProgramReference([broken]))
    made.run(1)
    assert made.machine.stage is Stage.QUICK_STOPPING
    made.run(100)
    assert (made.machine.stage, made.machine.reason) == (Stage.OFF, "axis x: the set point is not a number")


def test_fault_during_a_requested_stop_is_reported(stand: Callable[..., Stand]) -> None:
    made = stand().start()
    made.machine.event(Event.STOP_SIGNAL, "stopped by SIGINT")
    made.machine.event(Event.FOLLOWING_ERROR, "following error")
    assert made.machine.reason == "stopped by SIGINT; following error"
    assert made.faults == [(Event.FOLLOWING_ERROR, "following error")]


def test_few_missing_inputs_are_tolerated(stand: Callable[..., Stand]) -> None:
    made = stand().start()
    for _ in range(3):
        made.absent = {0}
        made.run(5)
        made.absent = set()
        made.run(1)
    assert (made.machine.stage, made.machine.missing_inputs) == (Stage.RUNNING, 15)


def test_absent_node_is_lost_and_the_others_brake(stand: Callable[..., Stand]) -> None:
    made = stand().start()
    made.absent = {0}
    made.run(2000)
    assert (made.machine.stage, made.machine.reason) == (Stage.OFF, "dx: its TPDOs are no longer received")
    assert made.drives[1].statusword == 0x0240
    assert made.drives[0].controlwords[-1] == 0x02, "it may hear us although we do not hear it"


def test_loss_of_all_nodes_switches_off_in_the_same_cycle(stand: Callable[..., Stand]) -> None:
    made = stand(missing_tolerated=0).start()
    made.absent = {0, 1, 2, 3}
    made.run(1)
    assert (made.on, made.machine.stage) == (False, Stage.OFF)


def test_program_keeps_true_time_over_missed_ticks(stand: Callable[..., Stand]) -> None:
    steady, jumpy = stand().start(), stand().start()
    steady.run(30)
    jumpy.run(3, elapsed=10)
    assert jumpy.cycle == steady.cycle
    assert jumpy.rows[-1][3] == steady.rows[-1][3]
    assert jumpy.machine.missed_ticks == 27


def test_long_gap_stops_the_machine(stand: Callable[..., Stand]) -> None:
    made = stand().start()
    made.run(1, elapsed=40)
    assert made.machine.stage is Stage.STOPPING
    assert made.machine.reason == "39 consecutive ticks were missed: this computer is too busy"


def test_hours_without_ticks_cost_no_time(stand: Callable[..., Stand]) -> None:
    """A process that was stopped by its terminal: the axes must not wait for its book-keeping."""
    made = stand().start()
    started_s = time.perf_counter()
    made.run(1, elapsed=10**9)
    assert time.perf_counter() - started_s < 1.0
    assert made.machine.stage is Stage.STOPPING


def test_stop_while_the_drives_are_being_switched_on(stand: Callable[..., Stand]) -> None:
    made = stand().run(2)
    made.machine.event(Event.STOP_SIGNAL, "stopped by SIGINT")
    made.run(100)
    assert (made.machine.stage, made.machine.failed) == (Stage.OFF, False)


def test_program_cannot_start_once_the_machine_stops(stand: Callable[..., Stand]) -> None:
    made = stand().run(60)
    made.machine.event(Event.STOP_SIGNAL, "stopped by SIGINT")
    made.machine.run(ProgramReference([]))
    assert made.machine.stage is Stage.STOPPING


def program(made: Stand, *steps: Any) -> ProgramReference:
    return ProgramReference(program_segments(steps, made.config, made.machine.set_points_m()))


def test_served_machine_is_ready_again_after_a_program_and_runs_the_next_one_from_there(
    stand: Callable[..., Stand],
) -> None:
    made = stand()
    made.machine.served = True
    made.start().run(2000)
    assert (made.machine.stage, made.rests, made.machine.completed) == (Stage.READY, 1, True)
    assert made.machine.set_points_m() == [0.002, 0.001]
    made.machine.run(program(made, AWAY._replace(to_m=(0.0, np.nan))))
    assert (made.run(1).machine.stage, made.machine.completed) == (Stage.RUNNING, False)
    made.run(2000)
    assert (made.machine.stage, made.rests) == (Stage.READY, 2)
    assert made.positions_m() == pytest.approx([0.0, 0.001], abs=COUNT_M)
    assert np.abs(np.diff([row[3] for row in made.rows[60:]])).max() < 1e-4, "no jump between the programs"
    made.machine.finish()
    made.run(100)
    assert (made.machine.stage, made.machine.failed, made.machine.reason) == (Stage.OFF, False, "")


def test_next_program_may_begin_in_the_cycle_in_which_the_last_one_ended(stand: Callable[..., Stand]) -> None:
    made = stand()
    made.machine.served = True

    def again() -> None:
        made.rests += 1
        if made.rests < 3:
            made.machine.run(program(made, Dwell("rest", 0.010)))

    made.machine.on_rest = again
    made.run(60)
    made.machine.run(program(made, Dwell("rest", 0.010)))
    made.run(40)
    assert made.rests == 3
    assert [row[2] for row in made.rows].count(0) == 30


def test_interrupted_program_ramps_down_within_the_limit_and_the_axes_stay_under_control(
    stand: Callable[..., Stand],
) -> None:
    made = stand()
    made.machine.served = True
    made.start()
    made.machine.interrupt()
    made.machine.interrupt()  # asked twice is asked once
    made.run(2000)
    assert (made.machine.stage, made.rests, made.machine.completed) == (Stage.READY, 1, False)
    assert (made.machine.failed, made.stops) == (False, [])
    commands = np.array([row[3] for row in made.rows[60:]])
    assert np.abs(np.diff(commands, 2)).max() <= 2.0 * PERIOD_S**2 * 1.001
    assert made.machine.set_points_m()[0] == commands[-1] < 0.002


def test_stop_while_an_interrupted_program_ramps_down_switches_off(stand: Callable[..., Stand]) -> None:
    made = stand()
    made.machine.served = True
    made.start()
    made.machine.interrupt()
    made.run(2)
    made.machine.event(Event.STOP_SIGNAL, "stopped by SIGINT")
    made.run(2000)
    assert (made.machine.stage, made.rests, made.stops) == (Stage.OFF, 0, ["stopped by SIGINT"])
    commands = np.array([row[3] for row in made.rows if np.isfinite(row[3])])
    assert np.abs(np.diff(commands, 2)).max() <= 2.0 * PERIOD_S**2 * 1.001
