"""Forces on the table during a program, for pictures: from the batch twin, which knows the plant.

No sensor shows them, and the controller never sees them.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from hil_sim.config import build_plant
from kernels.arrays import Array
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.config.program_model import ProgramConfig
from twin.axis_rollout import AxisRollout
from twin.plant_file import load_plant
from twin.rollout import substeps_of
from twin.wiring import wires_of


class TableForces(NamedTuple):
    """Of the first axis; (n,) at the SYNC period, from the start of the program."""

    time_s: Array
    transmitted_n: Array
    """From the screw to the table."""
    friction_n: Array
    """On the table."""
    table_velocity_m_s: Array
    scale_position_m: Array


def table_forces(machine_file: Path, plant_file: Path, program_file: Path) -> TableForces:
    """Run the program from rest at power-up on the machine's plant.

    Raises ServoCtrlError for a file that cannot be used.
    """
    machine, plant_config = load_machine(machine_file), load_plant(plant_file)
    program = load_program(program_file, machine)
    axis = next(iter(machine.axes))
    plant = build_plant(plant_config)
    index = list(plant_config.axes).index(axis)
    wires = wires_of(machine.axes[axis], plant_config.axes[axis])
    plant.setpoint[index]["current_limit_a"] = wires.current_limit_a
    substeps = substeps_of(machine, plant_config)
    twin = AxisRollout(
        params=axis_params(machine, axis),
        wires=wires,
        plant=plant,
        index=index,
        substeps=substeps,
        dt_s=plant_config.dt_s,
    )
    state = plant.state[index]
    rows = []
    for command in _commands(machine, program, list(machine.axes).index(axis)):
        row = twin.rows(command[np.newaxis])[0]
        truth = [state[name] for name in ("transmitted_n", "friction_n", "table_velocity_m_s")]
        rows.append([*truth, row["scale_position_m"]])
    time_s = np.arange(len(rows), dtype=np.float64) * machine.period_s
    transmitted_n, friction_n, velocity_m_s, position_m = np.array(rows, dtype=np.float64).T
    return TableForces(time_s, transmitted_n, friction_n, velocity_m_s, position_m)


def _commands(machine: MachineConfig, program: ProgramConfig, index: int) -> Array:
    """Set points (n, 4) of the program."""
    parts = []
    for part in program_segments(check_program(program, machine), machine, np.zeros(len(machine.axes))):
        columns = (part.position_m, part.velocity_m_s, part.acceleration_m_s2, part.force_offset_n)
        parts.append(np.stack([column[:, index] for column in columns], axis=-1))
    return np.concatenate(parts)
