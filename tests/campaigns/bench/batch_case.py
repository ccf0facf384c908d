"""What the batch benchmarks run: the X-Y table on its circles, ready for our kernel and for the one in C."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import Plant, PlantConfig, build_plant, load_plant
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.control.tick import AxisParams
from twin.bus_scaling import bus_scaling

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
PROGRAM = MACHINE / "programs" / "circles.toml"


class Case(NamedTuple):
    """A machine and what its axes are to do; `reference[axis]` is (n, 4) as `rollout` takes it."""

    machine: MachineConfig
    plant: PlantConfig
    params: dict[str, AxisParams]
    reference: dict[str, Array]

    @property
    def simulated_s(self) -> float:
        return len(next(iter(self.reference.values()))) * self.machine.period_s


class AxisCase(NamedTuple):
    """One axis, ready to be run by either kernel; `plant` is at power-up and is advanced in place."""

    name: str
    params: AxisParams
    scaling: Any
    plant: Plant
    index: int
    reference: Array


def load_case(machine_folder: Path = MACHINE, program: Path = PROGRAM) -> Case:
    """The table running its circles at four feeds."""
    machine = load_machine(machine_folder)
    steps = check_program(load_program(program, machine), machine)
    segments = list(program_segments(steps, machine, np.zeros(len(machine.axes))))
    reference = {}
    for i, axis in enumerate(machine.axes):
        columns = [
            np.concatenate([getattr(segment, field)[:, i] for segment in segments])
            for field in ("position_m", "velocity_m_s", "acceleration_m_s2", "force_offset_n")
        ]
        reference[axis] = np.ascontiguousarray(np.stack(columns, axis=1))
    return Case(
        machine,
        load_plant(machine_folder),
        {axis: axis_params(machine, axis) for axis in reference},
        reference,
    )


def axis_cases(case: Case) -> list[AxisCase]:
    """Fresh axes, at power-up."""
    plant = build_plant(case.plant)
    axes = []
    for index, (name, axis_plant) in enumerate(case.plant.axes.items()):
        scaling = bus_scaling(case.machine.axes[name], axis_plant)
        plant.setpoint[index]["current_limit_a"] = scaling.current_limit_a
        axes.append(AxisCase(name, case.params[name], scaling, plant, index, case.reference[name]))
    return axes
