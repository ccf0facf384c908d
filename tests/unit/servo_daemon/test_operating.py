"""A machine that is operated: power, faults, homing, jogging and feed hold, asked of the desk."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from ideal_drives import COUNT_M, PERIOD_S, OperatedStand, ideal_machine_file

from servo_ctrl.axis.fault_policy import Event, Stage
from servo_ctrl.config.desk import JOG_RENEWAL_S, Command, Refusal
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.telemetry.mqtt_commands import CommandDesk

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from servo_ctrl.config.program_model import ProgramConfig

    Make = Callable[..., OperatedStand]

ROUND = """
[[step]]
kind = "circle"
label = "round"
radius_mm = 5.0
feed_mm_min = 3000.0
turns = 1.0
[[step]]
kind = "dwell"
label = "rest"
seconds = 0.05
"""
RENEWAL = round(JOG_RENEWAL_S / PERIOD_S)
OFF = [0x0240, 0x0240]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    def made(*, homing_method: int = 0, **options: Any) -> OperatedStand:
        path = ideal_machine_file(tmp_path, homing_method=homing_method)
        return OperatedStand(path, tmp_path / "learned", **options)

    return made


@pytest.fixture
def enabled(make: Make) -> Make:
    def made(**options: Any) -> OperatedStand:
        stand = make(**options)
        stand.run(3)
        assert stand.ask(Command.ENABLE).accepted
        stand.run(100)
        assert stand.machine.stage is Stage.READY
        return stand

    return made


@pytest.fixture
def program(tmp_path: Path) -> ProgramConfig:
    path = tmp_path / "round.toml"
    path.write_text(ROUND, encoding="utf-8")
    return load_program(path, load_machine(ideal_machine_file(tmp_path)))


def commands(made: OperatedStand) -> np.ndarray:
    """Position commands of both axes, (n, 2), where they were led."""
    both = np.array([[row[3], row[15]] for row in made.rows])
    return both[np.isfinite(both).all(axis=1)]


def test_run_without_a_program_begins_in_standby_and_switches_on_when_asked(make: Make) -> None:
    made = make()
    made.run(200)
    assert (made.machine.stage, made.status.reason) == (Stage.STANDBY, "")
    assert [drive.statusword for drive in made.drives] == OFF
    assert not any(word in {0x06, 0x07, 0x0F} for drive in made.drives for word in drive.told)
    assert made.ask(Command.ENABLE).accepted
    assert made.machine.stage is Stage.STARTING
    made.run(100)
    assert made.machine.stage is Stage.READY
    x = made.status.drives[0]
    assert (x.axis, x.phase, x.state, x.ready, x.limits_m) == (
        "x",
        "servo",
        "operation enabled",
        True,
        (-0.1, 0.1),
    )


def test_drive_that_is_found_with_power_brakes_before_standby(make: Make) -> None:
    made = make()
    made.drives[1].statusword = 0x0227
    made.run(10)
    assert made.drives[1].told[0] == 0x02
    assert made.machine.stage is Stage.STANDBY


def test_disable_ramps_down_and_ends_in_standby_with_its_reason(
    enabled: Make, program: ProgramConfig
) -> None:
    made = enabled()
    assert made.desk.load_program(program).accepted
    assert made.ask(Command.START_PROGRAM).accepted
    made.run(300)
    assert made.ask(Command.DISABLE).accepted
    assert made.machine.stage is Stage.STOPPING
    made.run(300)
    assert (made.machine.stage, made.machine.failed) == (Stage.STANDBY, False)
    assert made.status.reason == "switched off by the operator"
    assert np.abs(np.diff(commands(made), 2, axis=0)).max() <= 2.0 * PERIOD_S**2 * 1.001
    verdict = made.ask(Command.DISABLE)
    assert verdict.reason == "the machine is standby, and has no power that could be switched off"


def test_quick_stop_is_told_to_every_drive_in_the_next_cycle(enabled: Make) -> None:
    made = enabled()
    assert made.desk.jog("x", 0.05).accepted
    made.run(50)
    assert made.ask(Command.QUICK_STOP).accepted
    made.run(1)
    assert [drive.told[-1] for drive in made.drives] == [0x02, 0x02]
    made.run(20)
    assert (made.machine.stage, made.status.reason) == (Stage.STANDBY, "quick stop by the operator")
    assert not made.machine.failed
    assert made.ask(Command.QUICK_STOP).accepted, "a stop is never refused"


def test_fault_is_kept_until_the_machine_is_enabled_again(enabled: Make) -> None:
    made = enabled()
    made.drives[1].statusword = 0x0208
    made.run(50)
    assert made.machine.stage is Stage.STANDBY
    assert (made.status.reason, made.machine.failed) == ("axis y: the drive is in fault", True)
    assert made.status.drives[1].state == "fault"
    assert made.ask(Command.ENABLE).accepted
    made.run(100)
    assert (made.machine.stage, made.status.reason, made.machine.failed) == (Stage.READY, "", False)
    assert 0x80 in made.drives[1].told


def test_events_in_standby_are_noted_and_nothing_moves(make: Make) -> None:
    made = make()
    made.run(5)
    for event in set(Event) - {Event.STOP_SIGNAL, Event.BUS_DOWN, Event.FOREIGN_MASTER}:
        made.machine.event(event, event.value)
    made.run(5)
    assert (made.machine.stage, made.status.reason) == (Stage.STANDBY, "")
    assert Event.EMCY.value in made.machine.events.kept


@pytest.mark.parametrize("event", [Event.STOP_SIGNAL, Event.FOREIGN_MASTER])
def test_what_ends_the_run_ends_it_from_standby_and_from_a_stop_on_the_way_there(
    make: Make, enabled: Make, event: Event
) -> None:
    for made in (make().run(5), enabled()):
        if made.machine.stage is Stage.READY:
            made.ask(Command.QUICK_STOP)
        made.machine.event(event, "over")
        made.run(50)
        assert made.machine.stage is Stage.OFF


class PretendedNodes:
    """`answering` are those that answer; `problem` is the objection."""

    def __init__(self) -> None:
        self.answering: set[int] = set()
        self.problem = ""
        self.changed: dict[int, str] = {}

    def back(self, lost: frozenset[int]) -> list[int]:
        return sorted(self.answering & set(lost))

    def objection(self, lost: frozenset[int]) -> str:
        return self.problem or ("it is away" if lost else "")


def test_node_that_was_given_up_may_come_back(enabled: Make) -> None:
    made = enabled()
    nodes = PretendedNodes()
    made.machine.nodes = nodes  # type: ignore[assignment]  # what the machine asks of them
    made.absent = {2}
    made.run(30)
    assert made.machine.stage is Stage.STANDBY
    assert made.status.reason == "dy: its cyclic inputs do not come any more"
    assert (made.status.drives[1].phase, made.status.drives[1].state) == ("lost", "not heard")
    verdict = made.ask(Command.ENABLE)
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, "it is away")
    nodes.answering, made.absent = {2}, set()
    made.run(5)
    assert made.status.drives[1].state == "switch on disabled"
    assert made.machine.events.kept[-1] == "dy: its cyclic inputs come again"
    nodes.problem = "it has restarted"
    assert made.ask(Command.ENABLE).reason == "it has restarted"
    nodes.problem = ""
    assert made.ask(Command.ENABLE).accepted
    made.run(100)
    assert made.machine.stage is Stage.READY


def test_axis_that_is_homed_keeps_its_home_when_it_is_enabled_again(enabled: Make) -> None:
    made = enabled(homing_method=37)
    assert all(drive.homed for drive in made.status.drives)
    made.desk.jog("x", 0.05)
    made.run(400)
    at = made.drives[0].position
    assert at > 1000
    made.ask(Command.DISABLE)
    made.run(50)
    made.ask(Command.ENABLE)
    made.run(100)
    assert (made.machine.stage, made.drives[0].position) == (Stage.READY, at)
    assert made.status.drives[0].homed


def test_home_is_looked_for_anew_by_one_axis_while_the_other_stays(enabled: Make) -> None:
    made = enabled(homing_method=37)
    for axis in ("x", "y"):
        made.desk.jog(axis, 0.05)
    made.run(400)
    at_y = made.drives[1].position
    assert made.ask(Command.HOME, "x").accepted
    assert made.machine.stage is Stage.STARTING
    assert not made.status.drives[0].homed
    made.run(60)
    assert made.machine.stage is Stage.READY
    assert made.status.drives[0].homed
    assert (made.drives[0].position, made.drives[1].position) == (0, at_y)
    assert made.machine.set_points_m() == pytest.approx([0.0, at_y * COUNT_M], abs=COUNT_M)
    assert made.desk.jog("y", -0.05).accepted
    made.run(1)
    assert abs(made.drives[1].position - at_y) * COUNT_M < 2e-6, "it goes on from where it stands"


def test_axis_without_a_homing_method_is_not_homed(enabled: Make) -> None:
    made = enabled()
    assert made.ask(Command.HOME, "y").reason == "axis y has no homing method (homing_method = 0)"


def test_jog_goes_on_while_it_is_renewed_and_stops_when_it_is_not(enabled: Make) -> None:
    made = enabled()
    for _ in range(3):
        assert made.desk.jog("x", 0.02).accepted
        assert made.desk.jog("y", -0.01).accepted
        made.run(200)
    assert made.machine.stage is Stage.RUNNING
    made.run(RENEWAL)
    assert made.machine.stage is Stage.READY
    way_s = 3 * 200 * PERIOD_S + RENEWAL * PERIOD_S - 200 * PERIOD_S
    assert made.positions_m() == pytest.approx([0.02 * way_s, -0.01 * way_s], abs=1e-6)
    assert not made.machine.failed


def test_jog_is_refused_in_words(enabled: Make, make: Make, program: ProgramConfig) -> None:
    made = enabled()
    said = made.desk.jog("x", 0.3)
    assert said.refusal is Refusal.OUT_OF_RANGE
    assert said.reason == "300 mm/s is beyond the velocity limit of axis x, 200 mm/s"
    assert made.desk.jog("z", 0.1).refusal is Refusal.UNKNOWN
    assert made.desk.jog("x", float("nan")).refusal is Refusal.OUT_OF_RANGE
    made.desk.load_program(program)
    made.ask(Command.START_PROGRAM)
    assert made.desk.jog("x", 0.01).reason == "the machine is running, not ready"
    off = make().run(5)
    assert off.desk.jog("x", 0.01).reason == "the machine is standby, not ready"


def test_jog_ends_on_the_software_limit(enabled: Make) -> None:
    made = enabled()
    while made.machine.stage is Stage.READY or made.positions_m()[0] < 0.0999:
        made.desk.jog("x", 0.2)
        made.run(100)
        assert made.cycle < 3000
    made.run(300)
    assert (made.machine.stage, made.machine.failed) == (Stage.READY, False)
    assert made.positions_m()[0] == pytest.approx(0.1, abs=COUNT_M)


def test_program_is_held_on_its_path_resumed_and_ends_where_it_would(
    enabled: Make, program: ProgramConfig
) -> None:
    made = enabled()
    assert made.ask(Command.HOLD_PROGRAM).reason == "no program is running"
    assert made.desk.load_program(program).accepted
    assert (made.status.program.name, made.status.program.loaded) == ("round.toml", True)
    made.ask(Command.START_PROGRAM)
    made.run(300)
    assert made.ask(Command.RESUME_PROGRAM).reason == "the program is not held"
    assert made.ask(Command.HOLD_PROGRAM).accepted
    assert made.ask(Command.HOLD_PROGRAM).reason == "the program is held already"
    made.run(200)
    status = made.status.program
    assert (status.held, status.step, status.label, made.machine.stage) == (True, 0, "round", Stage.RUNNING)
    assert 0.2 < status.progress < 0.8
    assert made.ask(Command.START_PROGRAM).reason == "the program is held; resume it, or abort it first"
    at = commands(made)[-1]
    assert np.hypot(at[0] + 0.005, at[1]) == pytest.approx(0.005, abs=1e-12)
    assert (commands(made)[-50:] == at).all()
    assert [row[2] for row in made.rows[-220:]] == [0] * 20 + [-1] * 200, "none of production"
    assert made.ask(Command.RESUME_PROGRAM).accepted
    made.run(1500)
    assert made.machine.stage is Stage.READY
    assert made.status.program.progress == 1.0
    assert commands(made)[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert np.abs(np.diff(commands(made), 2, axis=0)).max() <= 2.0 * PERIOD_S**2 * 1.001


def test_held_program_is_aborted_and_started_afresh(enabled: Make, program: ProgramConfig) -> None:
    made = enabled()
    made.desk.load_program(program)
    for command in (Command.START_PROGRAM, Command.HOLD_PROGRAM):
        made.ask(command)
        made.run(200)
    assert made.ask(Command.ABORT_PROGRAM).accepted
    made.run(50)
    assert (made.machine.stage, made.machine.failed) == (Stage.READY, False)
    assert made.ask(Command.ABORT_PROGRAM).reason == "no program is running"
    assert made.ask(Command.START_PROGRAM).accepted
    made.run(100)
    assert (made.status.program.held, made.machine.stage) == (False, Stage.RUNNING)
    assert made.ask(Command.ABORT_PROGRAM).accepted
    made.run(300)
    assert made.machine.stage is Stage.READY


def test_program_beyond_the_limits_is_not_loaded_and_the_one_before_stays(
    enabled: Make, program: ProgramConfig, tmp_path: Path
) -> None:
    made = enabled()
    made.desk.load_program(program)
    wide = tmp_path / "wide.toml"
    wide.write_text(ROUND.replace("radius_mm = 5.0", "radius_mm = 80.0"), encoding="utf-8")
    verdict = made.desk.load_program(load_program(wide, made.config))
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    assert 'step[1] "round"' in verdict.reason
    assert made.status.program.problem == verdict.reason
    assert made.status.program.name == "round.toml"
    made.ask(Command.START_PROGRAM)
    assert made.status.program.problem == ""
    assert made.desk.load_program(program).reason == "the machine is running, neither ready nor in standby"


async def test_nothing_is_started_while_a_program_is_being_checked(
    enabled: Make, program: ProgramConfig
) -> None:
    made = enabled(lockstep=False)
    task = asyncio.create_task(made.services.workshop.run())
    assert made.desk.load_program(program).accepted
    assert made.status.program.preparing
    reason = "a program is being checked; wait for its end"
    for command in (Command.START_PROGRAM, Command.HOME):
        assert made.ask(command).reason in {reason, "the axes have no homing method (homing_method = 0)"}
    assert made.desk.jog("x", 0.01).reason == reason
    assert made.desk.load_program(program).reason == reason
    await made.services.workshop.finish()
    task.cancel()
    assert (made.status.program.preparing, made.status.program.name) == (False, "round.toml")


def test_program_of_the_run_is_started_once_and_not_again_by_enabling(
    make: Make, program: ProgramConfig
) -> None:
    made = make(program=program)
    made.run(300)
    assert made.machine.stage is Stage.RUNNING
    made.ask(Command.QUICK_STOP)
    made.run(50)
    assert made.machine.stage is Stage.STANDBY
    made.ask(Command.ENABLE)
    made.run(200)
    assert made.machine.stage is Stage.READY


def test_machine_that_does_not_stand_by_ends_as_before(make: Make) -> None:
    made = make(stand_by=False, serve=True)
    made.run(100)
    assert made.machine.stage is Stage.READY
    assert made.ask(Command.ENABLE).reason == "the machine is ready, not in standby"
    assert made.ask(Command.DISABLE).accepted
    made.run(50)
    assert (made.machine.stage, made.machine.failed) == (Stage.OFF, False)


def test_commands_arrive_by_mqtt_too(make: Make) -> None:
    made = make().run(5)
    messages = CommandDesk(made.desk)
    said = messages.answer(b'{"id": "1", "command": "enable"}', retained=False)
    assert said.refusal == "none"
    made.run(100)
    assert made.machine.stage is Stage.READY
    said = messages.answer(b'{"id": "2", "command": "hold_program"}', retained=False)
    assert (said.refusal, said.reason) == ("wrong_state", "no program is running")
    messages.answer(b'{"id": "3", "command": "quick_stop"}', retained=False)
    made.run(1)
    assert [drive.told[-1] for drive in made.drives] == [0x02, 0x02]
