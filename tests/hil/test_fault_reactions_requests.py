"""Fault policy in lockstep: requested stops, refused programs, invalid set points."""

import math
from pathlib import Path

import pytest
from fault_bench import BRAKE, POWER_OFF, FaultBench
from fault_reaction import FAULT_CYCLE, LAST_CYCLE, XY_TABLE, X, Y, assert_reaction_in_time
from program_steps import circle

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES
from servo_ctrl.axis.fault_policy import REQUESTS, Event, Reaction, reaction
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.daemon.handlers.program_start import ProgramStart
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan

TOO_FAR = circle(49.0, 3000.0)


@pytest.mark.parametrize("event", sorted(REQUESTS, key=lambda one: one.value))
def test_requested_stop_is_reacted_to_in_time_and_is_no_fault(event: Event) -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    assert bench.machine.stage is Stage.RUNNING
    cycle = bench.cycle.number
    bench.machine.event(event, "as requested")
    bench.run(LAST_CYCLE)
    assert_reaction_in_time(bench, event, since=cycle)
    assert bench.machine.reason == "as requested"
    if reaction(Stage.RUNNING, event) is Reaction.HOLD:
        off = bench.reacted(X, POWER_OFF)
        assert bench.moving[-1] < off, "the axes must stand still before the power goes"
        assert bench.reacted(Y, POWER_OFF) == off
    else:
        assert bench.at_rest(0)
        assert bench.at_rest(1)


def test_second_stop_signal_makes_the_drives_brake() -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    bench.machine.event(Event.STOP_SIGNAL, "stopped by SIGINT")
    bench.run(5)
    assert bench.machine.stage is Stage.STOPPING
    cycle = bench.cycle.number
    bench.machine.event(Event.STOP_SIGNAL, "stopped by SIGINT")
    bench.run(LAST_CYCLE)
    for node in (X, Y):
        assert bench.reacted(node, BRAKE) - cycle <= BOUND_CYCLES[Event.STOP_SIGNAL]
    assert not bench.machine.failed


@pytest.mark.parametrize("field", range(4))
def test_non_finite_set_point_makes_the_drives_brake(field: int) -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    program = bench.machine.program
    assert program is not None
    advance = program.advance

    def broken(cycle: int) -> list[float]:
        row = list(advance(cycle) or ())
        row[4 + field] = math.nan
        return row

    program.advance = broken  # type: ignore[method-assign]  # a bug of ours
    cycle = bench.cycle.number
    bench.run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.BAD_COMMAND, since=cycle)
    assert bench.machine.reason == "axis y: the set point is not a number"
    assert bench.at_rest(0)
    assert bench.at_rest(1)


class Refusing(FaultBench):
    """Starts a program that leaves the limits from where the axes are; its start is refused."""

    program: Path

    def _move(self) -> None:
        motion = MotionPlan(self.config, load_program(self.program, load_machine(XY_TABLE)))
        self.machine.set_points_m = lambda: [-0.05, 0.0]  # type: ignore[method-assign]  # not at home
        ProgramStart(self.machine, motion, BackgroundWorker(lockstep=True), lambda: None).start_run()


def test_refused_program_switches_off_axes_that_have_not_moved(tmp_path: Path) -> None:
    Refusing.program = tmp_path / "far.toml"
    Refusing.program.write_text(TOO_FAR, encoding="utf-8")
    bench = Refusing(XY_TABLE).run(LAST_CYCLE)
    seen = bench.noted(Event.BAD_PROGRAM)
    for node in (X, Y):
        off = next(
            c for c, target, word in bench.controlwords if (target, word) == (node, POWER_OFF) and c >= seen
        )
        assert off - seen <= BOUND_CYCLES[Event.BAD_PROGRAM]
    assert "is beyond the limit -100 mm" in bench.machine.reason
    assert (bench.machine.failed, bench.off, bench.moving) == (True, True, [])
    assert len(bench.emcy()) == 1
