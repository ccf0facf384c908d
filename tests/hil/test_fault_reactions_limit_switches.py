"""Limit switches of every machine file: the drives brake in time in each mode, the axis can be jogged off."""

from pathlib import Path

import numpy as np
import pytest
from fault_bench import BRAKE, FaultBench
from fault_reaction import FAULT_CYCLE, FAULT_TIME_S, ROOT, X

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES, detection_cycles
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program import program_segments
from servo_ctrl.daemon.set_points.jog import Jog, JogLimits
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.motion.move import Move

FILES = sorted((ROOT / "machines").glob("*/controller*.toml"))
FEED_M_S = 0.05
LONGEST = 2000
"""Most cycles to standby: some machines have a slow quick stop ramp."""
LIMITS = JogLimits(-0.2, 0.2, 0.1, 1.0)


class Moving(FaultBench):
    """All axes move 60 mm to the positive side."""

    def _move(self) -> None:
        if self.moving:
            return
        start_m = self.machine.set_points_m()
        move = Move("far", tuple(at_m + 0.06 for at_m in start_m), FEED_M_S, np.inf, trapezoidal=False)
        self.machine.run(ProgramReference(program_segments([move], self.config, start_m)))


@pytest.mark.parametrize("file", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_limit_switch_makes_the_drives_brake_and_the_axis_can_be_moved_away(file: Path) -> None:
    assert all(axis.drive.limit_switch_syncs for axis in load_machine(file).axes.values())
    bench = Moving(file, f"limit_switch:x@{FAULT_TIME_S},side=1", plant=file.parent)
    bench.machine.stand_by = bench.machine.served = True
    while bench.machine.stage is not Stage.STANDBY:
        assert bench.cycle.number < LONGEST
        bench.run(100)
    seen = bench.noted(Event.LIMIT_SWITCH)
    assert 0 <= seen - FAULT_CYCLE <= detection_cycles(bench.config, lockstep=True)[Event.LIMIT_SWITCH] + 1
    assert bench.reacted(X, BRAKE) - seen <= BOUND_CYCLES[Event.LIMIT_SWITCH]
    assert bench.machine.reason == "axis x: the positive limit switch has closed"
    assert bench.machine.enable() == ""
    stood_m = bench.truth_m[-1][0]
    bench.run(300)
    assert bench.machine.stage is Stage.READY
    assert bench.truth_m[-1][0] == pytest.approx(stood_m, abs=2e-4), "a closed switch moves the axis"
    start_m = bench.machine.set_points_m()
    jog = Jog(start_m, [LIMITS] * len(start_m), bench.config.period_s, 1000)
    jog.request_velocity(0, -0.02)
    bench.machine.run(jog)
    bench.run(300)
    assert bench.machine.stage is Stage.RUNNING
    assert bench.machine.set_points_m()[0] < start_m[0] - 0.004
    assert bench.truth_m[-1][0] < bench.truth_m[-300][0] - 0.003
