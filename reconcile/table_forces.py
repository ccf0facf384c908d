"""What no sensor shows: driving and friction force on the table during a program, from the batch twin.

    python -m reconcile.table_forces --machine machines/fuzzy_table --controller FILE --program FILE \
        --out out/forces.npz

For pictures alone: the controller never sees them. Columns of the first axis, a row a SYNC period: time_s,
transmitted_n (screw to table), friction_n (on the table), table_velocity_m_s, scale_position_m.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hil_sim.config import build_plant, load_plant
from reconcile.axis_rollout import COLUMNS, AxisRollout
from reconcile.rollout import substeps_of
from reconcile.wiring import wires_of
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program, program_segments
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig

    Array = NDArray[np.float64]


def table_forces(
    machine: MachineConfig, plant_config: PlantConfig, program: ProgramConfig
) -> dict[str, Array]:
    """The columns, (n,) each, of the first axis; the program runs from rest at power-up."""
    axis = next(iter(machine.axes))
    plant = build_plant(plant_config)
    index = list(plant_config.axes).index(axis)
    wires = wires_of(machine.axes[axis], plant_config.axes[axis])
    plant.setpoint[index]["current_limit_a"] = wires.current_limit_a
    substeps = substeps_of(machine, plant_config)
    twin = AxisRollout(axis_params(machine, axis), wires, plant, index, substeps, plant_config.dt_s)
    state = plant.state[index]
    rows = []
    for command in _commands(machine, program, list(machine.axes).index(axis)):
        row = twin.rows(command[np.newaxis])[0]
        hidden = [state[name] for name in ("transmitted_n", "friction_n", "table_velocity_m_s")]
        rows.append([*hidden, row[COLUMNS.index("scale_position_m")]])
    names = ("transmitted_n", "friction_n", "table_velocity_m_s", "scale_position_m")
    columns = np.array(rows, dtype=np.float64).T
    return {"time_s": np.arange(len(rows)) * machine.period_s, **dict(zip(names, columns, strict=True))}


def _commands(machine: MachineConfig, program: ProgramConfig, index: int) -> Array:
    """Set points (n, 4) of the program."""
    parts = []
    for part in program_segments(check_program(program, machine), machine, np.zeros(len(machine.axes))):
        columns = (part.position_m, part.velocity_m_s, part.acceleration_m_s2, part.force_offset_n)
        parts.append(np.stack([column[:, index] for column in columns], axis=-1))
    return np.concatenate(parts)


def main() -> None:
    """Run the program and write the columns."""
    parser = argparse.ArgumentParser(description="Forces on the table during a program, from the batch twin.")
    parser.add_argument(
        "--machine", type=Path, required=True, help="directory of the machine, or its plant file"
    )
    parser.add_argument("--controller", type=Path, required=True, help="the machine file that acts")
    parser.add_argument("--program", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True, help="npz file")
    options = parser.parse_args()
    machine = load_machine(options.controller)
    program = load_program(options.program, machine)
    columns = table_forces(machine, load_plant(options.machine), program)

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **columns)

    write_whole(options.out, write)


if __name__ == "__main__":
    main()
