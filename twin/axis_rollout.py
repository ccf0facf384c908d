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
from kernels.jit import kernel, threaded_kernel
from kernels.record_layout import Pool, store
from servo_ctrl.axis.axis_watch import EVENT_OF
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.cyclic.axis_record import AxisParts, cycle_records
from servo_ctrl.cyclic.axis_step import AXIS_COLUMNS, step_axis
from servo_ctrl.cyclic.drive_phases import Phase
from servo_ctrl.cyclic.sequence_state import Sequence
from servo_ctrl.recording.channels import AXIS_CHANNELS
from twin.bus_scaling import BusScaling, axis_parts, bus_scaling, substeps_of

COLUMNS = tuple(channel.name for channel in AXIS_CHANNELS if channel.dtype == "float64")
"""Columns of an axis, as in a recording, without the statusword, which is constant under power."""
ROW = np.dtype([(channel.name, np.float64) for channel in AXIS_CHANNELS])
Rows = np.ndarray[Any, np.dtype[np.void]]
"""Array (n,) of `ROW`."""
POWERED_STATUSWORD = 0x0637
"""Operation enabled, voltage enabled, remote, target reached (CiA 402)."""
_NEVER = -1
"""First cycle of an event that has not occurred."""
EVENT_BITS = tuple(EVENT_OF)
"""Bits of the events that supervision may detect."""


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
        new = (self._event_cycles == _NEVER) & (event_cycles != _NEVER)
        self._event_cycles[new] = event_cycles[new] + self._cycles
        self._cycles += len(rows)
        return rows.view(ROW)[:, 0]


@kernel
def _apply_set_points(axis: Any, scaling: BusScaling, sp: Any, origin: int) -> None:
    """Write set points of the bus into the plant's SETPOINT record, like the drive's cyclic modes."""
    output, sent = axis["law"]["params"]["output"], axis["law"]["counts"]
    sp.loop = output + 1
    if output == 0:
        total = min(max(sent["torque"] + sent["torque_offset"], -scaling.max_torque), scaling.max_torque)
        sp.current_a = total * scaling.drive_ampere_per_torque
        sp.current_offset_a = 0.0
        return
    sp.current_offset_a = sent["torque_offset"] * scaling.drive_ampere_per_torque
    if output == 1:
        sp.velocity_m_s = sent["velocity"] * scaling.drive_metre_per_s_per_unit
        sp.velocity_offset_m_s = 0.0
    else:
        sp.position_m = (sent["position"] + origin) * scaling.drive_metre_per_count
        sp.velocity_offset_m_s = sent["velocity_offset"] * scaling.drive_metre_per_s_per_unit


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


@kernel
def latch_inputs(axis: Any, scaling: BusScaling, p: Any, s: Any, sp: Any, powered: bool, origin: int) -> int:
    """Latch the inputs at a SYNC; return the encoder counts at the zero of the axis."""
    inputs = axis["inputs"]
    if axis["engaged"] and not scaling.immediate:
        _apply_set_points(axis, scaling, sp, origin)
    if powered and not axis["engaged"]:
        origin = s.encoder_counts
    inputs["previous_motor_m"] = inputs["motor_m"]
    inputs["counts"] = s.encoder_counts - origin
    inputs["motor_m"] = inputs["counts"] * scaling.metre_per_count
    permille = np.rint(s.current_measured_a * scaling.drive_permille_per_ampere)
    inputs["current_a"] = permille * scaling.ampere_per_permille
    if p.scale.enabled:
        inputs["scale_raw_m"] = s.scale_counts * scaling.scale_metre_per_count
        inputs["scale_m"] = inputs["scale_raw_m"] + inputs["scale_offset_m"]
    return origin


@kernel
def control_axis(
    axis: Any,
    tables: Pool,
    supervision_memory: Array,
    scaling: BusScaling,
    sp: Any,
    reference: Array,
    cycle: int,
    powered: bool,
    origin: int,
    row: Array,
    event_bits: Any,
    event_cycles: Index,
) -> None:
    """Compute the controller's cycle on the latched inputs: set points, `row` (columns,) and new events.

    `event_cycles` (bits,) holds the first cycle of each event, _NEVER before it.
    """
    inputs = axis["inputs"]
    on = powered or axis["engaged"]
    if not on:
        row[2], row[6] = inputs["motor_m"], inputs["current_a"]
        return
    inputs["statusword"] = POWERED_STATUSWORD
    # complete and led; not `True`, a type of its own, for which numba would compile the daemon's kernel again
    step_axis(axis, tables, supervision_memory, on, reference, on, row)
    if axis["found"]:
        for event in range(len(event_bits)):
            if axis["found"] & event_bits[event] and event_cycles[event] == _NEVER:
                event_cycles[event] = cycle
    if scaling.immediate:
        _apply_set_points(axis, scaling, sp, origin)


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


def no_events() -> Index:
    """Return the first cycles (bits,) of the events of `EVENT_BITS` before any event."""
    return np.full(len(EVENT_BITS), _NEVER)


def events_of(event_cycles: Index) -> dict[Event, int]:
    """Return the first cycle of each event that occurred; several bits may report one event."""
    events: dict[Event, int] = {}
    for bit, cycle in zip(EVENT_BITS, event_cycles.tolist(), strict=True):
        if cycle != _NEVER:
            events[EVENT_OF[bit]] = min(cycle, events.get(EVENT_OF[bit], cycle))
    return events
