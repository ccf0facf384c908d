"""Jogging, programs and feed hold by operator commands."""

import asyncio
from pathlib import Path

import numpy as np
import pytest
from ideal_drives import COUNT_M, PERIOD_S, ROUND, Operate

from servo_ctrl.commands.command import JOG_RENEWAL_S, Command, Refusal
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_program
from servo_ctrl.config.program_model import ProgramConfig

RENEWAL = round(JOG_RENEWAL_S / PERIOD_S)
OFF = [0x0240, 0x0240]


def test_jog_goes_on_while_it_is_renewed_and_stops_when_it_is_not(enabled: Operate) -> None:
    made = enabled()
    for _ in range(3):
        assert made.handler.jog("x", 0.02).accepted
        assert made.handler.jog("y", -0.01).accepted
        made.run(200)
    assert made.machine.stage is Stage.RUNNING
    made.run(RENEWAL)
    assert made.machine.stage is Stage.READY
    way_s = 3 * 200 * PERIOD_S + RENEWAL * PERIOD_S - 200 * PERIOD_S
    assert made.positions_m() == pytest.approx([0.02 * way_s, -0.01 * way_s], abs=1e-6)
    assert not made.machine.failed


def test_refused_jog_gives_the_reason(
    enabled: Operate, operated: Operate, round_program: ProgramConfig
) -> None:
    made = enabled()
    result = made.handler.jog("x", 0.3)
    assert result.refusal is Refusal.OUT_OF_RANGE
    assert result.reason == "300 mm/s is beyond the velocity limit of axis x, 200 mm/s"
    assert made.handler.jog("z", 0.1).refusal is Refusal.UNKNOWN
    assert made.handler.jog("x", float("nan")).refusal is Refusal.OUT_OF_RANGE
    made.handler.load_program(round_program)
    made.ask(Command.START_PROGRAM)
    assert made.handler.jog("x", 0.01).reason == "the machine is running, not ready"
    off = operated().run(5)
    assert off.handler.jog("x", 0.01).reason == "the machine is standby, not ready"


def test_jog_ends_on_the_software_limit(enabled: Operate) -> None:
    made = enabled()
    while made.machine.stage is Stage.READY or made.positions_m()[0] < 0.0999:
        made.handler.jog("x", 0.2)
        made.run(100)
        assert made.cycle < 3000
    made.run(300)
    assert (made.machine.stage, made.machine.failed) == (Stage.READY, False)
    assert made.positions_m()[0] == pytest.approx(0.1, abs=COUNT_M)


def test_program_is_held_on_its_path_resumed_and_ends_where_it_would(
    enabled: Operate, round_program: ProgramConfig
) -> None:
    made = enabled()
    assert made.ask(Command.HOLD_PROGRAM).reason == "no program is running"
    assert made.handler.load_program(round_program).accepted
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
    at = made.commanded_m()[-1]
    assert np.hypot(at[0] + 0.005, at[1]) == pytest.approx(0.005, abs=1e-12)
    assert (made.commanded_m()[-50:] == at).all()
    assert [row[2] for row in made.rows[-220:]] == [0] * 20 + [-1] * 200, "none of production"
    assert made.ask(Command.RESUME_PROGRAM).accepted
    made.run(1500)
    assert made.machine.stage is Stage.READY
    assert made.status.program.progress == 1.0
    assert made.commanded_m()[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert np.abs(np.diff(made.commanded_m(), 2, axis=0)).max() <= 2.0 * PERIOD_S**2 * 1.001


def test_held_program_is_aborted_and_started_afresh(enabled: Operate, round_program: ProgramConfig) -> None:
    made = enabled()
    made.handler.load_program(round_program)
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
    enabled: Operate, round_program: ProgramConfig, tmp_path: Path
) -> None:
    made = enabled()
    made.handler.load_program(round_program)
    wide = tmp_path / "wide.toml"
    wide.write_text(ROUND.replace("radius_mm = 5.0", "radius_mm = 80.0"), encoding="utf-8")
    verdict = made.handler.load_program(load_program(wide, made.config))
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    assert 'step[1] "round"' in verdict.reason
    assert made.status.program.problem == verdict.reason
    assert made.status.program.name == "round.toml"
    made.ask(Command.START_PROGRAM)
    assert made.status.program.problem == ""
    assert (
        made.handler.load_program(round_program).reason
        == "the machine is running, neither ready nor in standby"
    )


async def test_nothing_is_started_while_a_program_is_being_checked(
    enabled: Operate, round_program: ProgramConfig
) -> None:
    made = enabled(lockstep=False)
    task = asyncio.create_task(made.services.worker.run())
    assert made.handler.load_program(round_program).accepted
    assert made.status.program.preparing
    reason = "a program is being checked; wait for its end"
    for command in (Command.START_PROGRAM, Command.HOME):
        assert made.ask(command).reason in {reason, "the axes have no homing method (homing_method = 0)"}
    assert made.handler.jog("x", 0.01).reason == reason
    assert made.handler.load_program(round_program).reason == reason
    await made.services.worker.finish()
    task.cancel()
    assert (made.status.program.preparing, made.status.program.name) == (False, "round.toml")


def test_program_of_the_run_is_started_once_and_not_again_by_enabling(
    operated: Operate, round_program: ProgramConfig
) -> None:
    made = operated(program=round_program)
    made.run(300)
    assert made.machine.stage is Stage.RUNNING
    made.ask(Command.QUICK_STOP)
    made.run(50)
    assert made.machine.stage is Stage.STANDBY
    made.ask(Command.ENABLE)
    made.run(200)
    assert made.machine.stage is Stage.READY
