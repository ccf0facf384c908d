"""One axis in the batch twin: the controller's cycle and the plant in one compiled loop, timed as on the bus.

At SYNC k the plant advances one period under the active set points; the set points buffered since SYNC k - 1
take effect; positions are latched in counts; the controller computes its cycle; its set points, in per mille
and counts, are buffered (transmission type 1: one period of delay) or take effect at once (255).

Sequence, law, supervision and row are those of the daemon (`cyclic.axis_step.step_axis`). The events that
supervision detects do not stop a rollout: `AxisRollout.findings` holds them.
"""

from typing import Any

import numpy as np

from hil_sim.config import Plant, PlantConfig
from hil_sim.plant.integrate import advance_axis
from kernels.arrays import Array, Index
from kernels.jit import threaded_kernel
from kernels.record_layout import Pool, store
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import AxisParts, cycle_records
from servo_ctrl.cyclic.axis_step import AXIS_COLUMNS
from servo_ctrl.cyclic.drive_phases import Phase
from servo_ctrl.cyclic.sequence_state import Sequence
from servo_ctrl.recording.channels import AXIS_CHANNELS
from twin.axis_cycle import EVENT_BITS, NEVER, control_axis, events_of, latch_inputs, no_events
from twin.bus_scaling import BusScaling, axis_parts, bus_scaling, substeps_of

COLUMNS = tuple(channel.name for channel in AXIS_CHANNELS if channel.dtype == "float64")
"""Columns of an axis, as in a recording, without the statusword, which is constant under power."""
ROW = np.dtype([(channel.name, np.float64) for channel in AXIS_CHANNELS])
Rows = np.ndarray[Any, np.dtype[np.void]]
"""Array (n,) of `ROW`."""


class AxisRollout:
    """Simulates one axis in consecutive calls of `rows`; advances `plant` in place.

    `plant`: all axes of `plant_config`.

    Raises:
        ValueError: the SYNC period is not a whole number of substeps, or the axis depends on another one,
            but here each axis is simulated alone.

    """

    def __init__(
        self, machine: MachineConfig, plant_config: PlantConfig, axis: str, params: AxisParams, plant: Plant
    ) -> None:
        index, scaling, parts = connect_axis(machine, plant_config, axis, params, plant)
        records, self._tables, supervision_memory = cycle_records([parts])
        store(records["sequence"], [switching_on(parts)])
        self._records, self._memory, self._scaling = records, supervision_memory[0], scaling
        self._plant = plant.params[index], plant.state[index], plant.setpoint[index]
        self._substeps, self._dt_s = substeps_of(machine, plant_config), plant_config.dt_s
        self._origin = 0
        self._cycles = 0
        self._event_cycles = no_events()

    @property
    def findings(self) -> dict[Event, int]:
        """Events at which the daemon would have stopped, with the first cycle of each since power-up."""
        return events_of(self._event_cycles)

    def change_params(self, params: AxisParams) -> None:
        """Change the control parameters, from the next cycle on."""
        self._tables = store(self._records["law"]["params"], [params])

    def rows(self, reference: Array, off_cycles: int = 0) -> Rows:
        """Return rows (n,) for the next set points (n, 4), see `rollout`.

        The drive has no power during the first `off_cycles`.
        """
        rows = np.full((len(reference), AXIS_COLUMNS), np.nan)
        event_cycles = no_events()
        p, s, sp = self._plant
        self._origin = _run_axis(
            axis=self._records[0],
            tables=self._tables,
            supervision_memory=self._memory,
            scaling=self._scaling,
            p=p,
            s=s,
            sp=sp,
            substeps=self._substeps,
            dt_s=self._dt_s,
            reference=np.ascontiguousarray(reference, dtype=np.float64),
            off_cycles=off_cycles,
            origin=self._origin,
            rows=rows,
            event_bits=EVENT_BITS,
            event_cycles=event_cycles,
        )
        new = (self._event_cycles == NEVER) & (event_cycles != NEVER)
        self._event_cycles[new] = event_cycles[new] + self._cycles
        self._cycles += len(rows)
        return rows.view(ROW)[:, 0]


@threaded_kernel  # threads simulate several axes, machines or variants at once
def _run_axis(
    axis: Any,
    tables: Pool,
    supervision_memory: Array,
    scaling: BusScaling,
    p: Any,
    s: Any,
    sp: Any,
    substeps: int,
    dt_s: float,
    reference: Array,
    off_cycles: int,
    origin: int,
    rows: Array,
    event_bits: Any,
    event_cycles: Index,
) -> int:
    """Fill `rows` (n, columns) and `event_cycles` (bits,); return the encoder counts at the axis's zero.

    `p`, `s` and `sp` are the AXIS_PARAMS, AXIS_STATE and SETPOINT records of the axis.
    """
    for k in range(len(reference)):
        advance_axis(p, s, sp, substeps, dt_s)
        powered = k >= off_cycles
        origin = latch_inputs(axis, scaling, p, s, sp, powered=powered, origin=origin)
        control_axis(
            axis,
            tables,
            supervision_memory,
            scaling,
            sp,
            reference=reference[k],
            cycle=k,
            powered=powered,
            origin=origin,
            row=rows[k],
            event_bits=event_bits,
            event_cycles=event_cycles,
        )
    return origin


def connect_axis(
    machine: MachineConfig, plant_config: PlantConfig, axis: str, params: AxisParams, plant: Plant
) -> tuple[int, BusScaling, AxisParts]:
    """Return the index of an axis in the plant, its scalings and the constants of its record.

    Writes the current limit of the drive to the plant's set points. Raises ValueError if the plant of the
    axis depends on another one.
    """
    index = list(plant_config.axes).index(axis)
    if plant.params[index]["cross_axis_coupling"]["enabled"]:
        raise ValueError("cross_axis_coupling: the batch twin simulates each axis alone, use the bus")
    scaling = bus_scaling(machine.axes[axis], plant_config.axes[axis])
    plant.setpoint[index]["current_limit_a"] = scaling.current_limit_a
    return index, scaling, axis_parts(machine.axes[axis], params, scaling)


def switching_on(parts: AxisParts) -> Sequence:
    """Return the sequence of a drive that is commanded to switch on, and does so once it has power."""
    return Sequence(int(Phase.SWITCHING_ON), 0, parts.route.mode)
