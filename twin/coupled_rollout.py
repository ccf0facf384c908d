"""All axes of a machine in the batch twin, simultaneously cycle by cycle: contour control couples two axes.

Plant, inputs, laws and rows of an axis are those of `axis_cycle`; between the inputs of all axes and their
laws the coupling of the daemon's cycle is computed (`cyclic.contour_coupling`).
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
from twin.axis_cycle import EVENT_BITS, control_axis, events_of, latch_inputs, no_events
from twin.axis_rollout import ROW, Rows, connect_axis, switching_on
from twin.bus_scaling import substeps_of


def coupled_rows(
    machine: MachineConfig,
    plant_config: PlantConfig,
    params: dict[str, AxisParams],
    plant: Plant,
    reference: dict[str, Array],
    off_cycles: int,
) -> tuple[dict[str, Rows], dict[str, dict[Event, int]]]:
    """Return rows (n,) and events of each axis, for set points `reference[axis]` (n, 4); see `rollout`.

    Raises:
        ValueError: as `AxisRollout`.

    """
    names = list(machine.axes)
    connected = [connect_axis(machine, plant_config, name, params[name], plant) for name in names]
    parts = [own for _, _, own in connected]
    records, tables, supervision_memory = cycle_records(parts)
    store(records["sequence"], [switching_on(own) for own in parts])
    set_points = np.ascontiguousarray(np.concatenate([reference[name] for name in names], axis=1))
    rows = np.full((len(names), len(set_points), AXIS_COLUMNS), np.nan)
    event_cycles = np.stack([no_events() for _ in names])
    _run_axes(
        axes=records,
        contours=contour_records(couplings(machine)),
        tables=tables,
        supervision_memory=supervision_memory,
        scalings=tuple(scaling for _, scaling, _ in connected),
        plant_index=np.array([index for index, _, _ in connected]),
        p=plant.params,
        s=plant.state,
        sp=plant.setpoint,
        substeps=substeps_of(machine, plant_config),
        dt_s=plant_config.dt_s,
        reference=set_points,
        off_cycles=off_cycles,
        rows=rows,
        event_bits=EVENT_BITS,
        event_cycles=event_cycles,
    )
    return (
        {name: own.view(ROW)[:, 0] for name, own in zip(names, rows, strict=True)},
        {name: events_of(own) for name, own in zip(names, event_cycles, strict=True)},
    )


@threaded_kernel
def _run_axes(
    axes: Any,
    contours: Any,
    tables: Pool,
    supervision_memory: Array,
    scalings: Any,
    plant_index: Index,
    p: Any,
    s: Any,
    sp: Any,
    substeps: int,
    dt_s: float,
    reference: Array,
    off_cycles: int,
    rows: Array,
    event_bits: Any,
    event_cycles: Index,
) -> None:
    """Fill `rows` (axes, n, columns) and `event_cycles` (axes, bits).

    `axes` (axes,) and `contours` (couplings,) are records of the controller; `plant_index` (axes,) is the
    index of each axis in the plant's records `p`, `s` and `sp`; `reference` is (n, 4 * axes).
    """
    origins = np.zeros(len(axes), np.int64)
    for k in range(len(reference)):
        powered = k >= off_cycles
        for axis in range(len(axes)):
            i = plant_index[axis]
            advance_axis(p[i], s[i], sp[i], substeps, dt_s)
            origins[axis] = latch_inputs(
                axes[axis], scalings[axis], p[i], s[i], sp[i], powered=powered, origin=origins[axis]
            )
        couple_axes(contours, axes, reference[k], REFERENCE_COLUMNS, powered)
        for axis in range(len(axes)):
            first = axis * REFERENCE_COLUMNS
            control_axis(
                axes[axis],
                tables,
                supervision_memory[axis],
                scalings[axis],
                sp[plant_index[axis]],
                reference=reference[k, first : first + REFERENCE_COLUMNS],
                cycle=k,
                powered=powered,
                origin=origins[axis],
                row=rows[axis, k],
                event_bits=event_bits,
                event_cycles=event_cycles[axis],
            )
