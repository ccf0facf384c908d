"""Forces on the table during a program, for pictures, from the plant of the batch twin.

No sensor measures them, and the controller never receives them.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program
from studies.twin_axis import motion, twin_axis
from twin.plant_file import load_plant


class TableForces(NamedTuple):
    """Forces on the table of the first axis, (n,) at the SYNC period, from the start of the program."""

    transmitted_n: Array
    """Force from the screw to the table."""
    friction_n: Array
    """Friction force on the table."""


def table_forces(machine_file: Path, plant_file: Path, program_file: Path) -> TableForces:
    """Run the program from standstill at power-up on the plant of the machine.

    Raises ServoCtrlError for a file that cannot be used.
    """
    machine = load_machine(machine_file)
    axis = next(iter(machine.axes))
    twin = twin_axis(machine, load_plant(plant_file), axis, axis_params(machine, axis))
    steps = check_program(load_program(program_file, machine), machine)
    forces_n = []
    for set_point in motion(machine, axis, steps, rest_cycles=0):
        twin.rollout.rows(set_point[np.newaxis])
        forces_n.append((twin.plant_state["transmitted_n"], twin.plant_state["friction_n"]))
    return TableForces(*np.array(forces_n, dtype=np.float64).T)
