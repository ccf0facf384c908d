"""All axes of a machine in the batch twin, cycle by cycle side by side: contour control needs two at once.

Plant, inputs, laws and rows of an axis are those of `axis_rollout`; between the inputs of all axes and their
laws stands the coupling of the daemon's cycle (`cyclic.contour_coupling`).
"""

from typing import Any

import numpy as np

from hil_sim.config import Plant, PlantConfig
from hil_sim.plant.integrate import advance_axis
from kernels.arrays import Array, Index
from kernels.jit import threaded_kernel
from kernels.record_layout import Pool, store
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.config.contour import couplings
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import cycle_records
from servo_ctrl.cyclic.axis_step import AXIS_COLUMNS, REFERENCE_COLUMNS
from servo_ctrl.cyclic.contour_coupling import contour_records, couple_axes
from twin.axis_rollout import (
    BITS,
    ROW,
    Rows,
    answer,
    events_of,
    latch,
    nothing_found,
    switching_on,
    wired_axis,
)
from twin.wiring import substeps_of


def coupled_rows(
    machine: MachineConfig,
    plant_config: PlantConfig,
    params: dict[str, AxisParams],
    plant: Plant,
    reference: dict[str, Array],
    off_cycles: int,
) -> tuple[dict[str, Rows], dict[str, dict[Event, int]]]:
    """Return rows (n,) and findings of each axis; see `rollout`.

    Raises:
        ValueError: as `AxisRollout`.

    """
    names = list(machine.axes)
    wired = [wired_axis(machine, plant_config, name, params[name], plant) for name in names]
    places: Index = np.array([index for index, _, _ in wired])
    parts = [own for _, _, own in wired]
    records, tables, kept = cycle_records(parts)
    store(records["sequence"], [switching_on(own) for own in parts])
    commands = np.ascontiguousarray(np.concatenate([reference[name] for name in names], axis=1))
    rows = np.full((len(names), len(commands), AXIS_COLUMNS), np.nan)
    found_at = np.stack([nothing_found() for _ in names])
    _run_axes(
        records,
        contour_records(couplings(machine)),
        tables,
        kept,
        tuple(wires for _, wires, _ in wired),
        places,
        *(plant.params, plant.state, plant.setpoint),
        *(substeps_of(machine, plant_config), plant_config.dt_s),
        commands,
        off_cycles,
        rows,
        BITS,
        found_at,
    )
    return (
        {name: own.view(ROW)[:, 0] for name, own in zip(names, rows, strict=True)},
        {name: events_of(own) for name, own in zip(names, found_at, strict=True)},
    )


@threaded_kernel
def _run_axes(
    axes: Any,
    contours: Any,
    tables: Pool,
    kept: Array,
    wires: Any,
    places: Index,
    p: Any,
    s: Any,
    sp: Any,
    substeps: int,
    dt_s: float,
    reference: Array,
    off_cycles: int,
    rows: Array,
    bits: Any,
    found_at: Index,
) -> None:
    """Fill `rows` (axes, n, columns) and `found_at` (axes, bits)."""
    origins = np.zeros(len(axes), np.int64)
    for k in range(len(reference)):
        power = k >= off_cycles
        for axis in range(len(axes)):
            at = places[axis]
            advance_axis(p[at], s[at], sp[at], substeps, dt_s)
            origins[axis] = latch(axes[axis], wires[axis], p[at], s[at], sp[at], power, origins[axis])
        couple_axes(contours, axes, reference[k], REFERENCE_COLUMNS, True)
        for axis in range(len(axes)):
            first = axis * REFERENCE_COLUMNS
            answer(
                axes[axis],
                tables,
                kept[axis],
                wires[axis],
                sp[places[axis]],
                reference[k, first : first + REFERENCE_COLUMNS],
                k,
                power,
                origins[axis],
                rows[axis, k],
                bits,
                found_at[axis],
            )
