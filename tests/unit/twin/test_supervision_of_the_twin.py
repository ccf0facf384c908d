"""The twin's supervision against that of the daemon in lockstep: the same event in the same cycle."""

from pathlib import Path

import numpy as np
import pytest
from fault_bench import COLUMN, FAR, SHARED, FaultBench
from machine_files import XY_TABLE, text_of, write_controller

from hil_sim.config import build_plant, load_plant
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program import program_segments
from twin.axis_rollout import AxisRollout
from twin.rollout import RolloutError, rollout

CYCLES = 1500


@pytest.mark.parametrize(
    ("text", "tighter", "event"),
    [
        ("following_error_mm = 1.0", "following_error_mm = 0.02", Event.FOLLOWING_ERROR),
        ("position_mm = [-100.0, 100.0]", "position_mm = [-100.0, 1.0]", Event.LIMIT),
    ],
)
def test_the_twin_finds_what_stops_the_daemon_in_the_same_cycle(
    text: str, tighter: str, event: Event, tmp_path: Path
) -> None:
    directory = write_controller(tmp_path, text_of(XY_TABLE / "controller.toml", {text: tighter})).parent
    bench = FaultBench(directory, plant=XY_TABLE)
    bench.run(CYCLES)
    stopped = {found: cycle for cycle, found in reversed(bench.events)}
    rows = np.array(bench.rows)
    started = int(np.flatnonzero(rows[:, 2] >= 0)[0])
    engaged = int(np.flatnonzero(np.isfinite(rows[:, SHARED + COLUMN["position_command_m"]]))[0])

    machine, plant = load_machine(directory), load_plant(XY_TABLE)
    (segment,) = program_segments([FAR], machine, [0.0, 0.0])
    parts = segment.position_m, segment.velocity_m_s, segment.acceleration_m_s2, segment.force_offset_n
    moves = np.stack([part[:, 0] for part in parts], axis=-1)
    reference = np.concatenate([np.zeros((started, 4)), moves])
    axis = AxisRollout(machine, plant, "x", axis_params(machine, "x"), build_plant(plant))
    axis.rows(reference[:started], engaged)
    axis.rows(reference[started:])
    assert axis.findings[event] == stopped[event]


def test_a_rollout_that_the_daemon_would_stop_says_when(tmp_path: Path) -> None:
    machine = load_machine(XY_TABLE)
    params = {name: axis_params(machine, name) for name in machine.axes}
    leap = np.zeros((100, 4))
    leap[60:, 0] = 2e-3
    with pytest.raises(RolloutError, match=r"axis x: following error after 0\.060 s"):
        rollout(machine, load_plant(XY_TABLE), params, dict.fromkeys(machine.axes, leap))
