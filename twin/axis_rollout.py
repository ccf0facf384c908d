"""One axis in the batch twin: the controller's cycle and the plant in one compiled loop, timed as on the bus.

At SYNC k the plant advances one period under the active set points; the set points buffered since SYNC k - 1
take effect; positions are latched in counts; the controller ticks; its set points, in per mille and counts,
are buffered (transmission type 1: one period of delay) or take effect at once (255).

Sequence, law, supervision and row are those of the daemon (`cyclic.axis_step.step_axis`). What its
supervision finds stops nothing here, but is kept: `AxisRollout.findings`.
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
from twin.wiring import Wires, parts_of, substeps_of, wires_of

COLUMNS = tuple(channel.name for channel in AXIS_CHANNELS if channel.dtype == "float64")
"""Columns of an axis, as in a recording; the twin's drive has one statusword once it has power."""
ROW = np.dtype([(channel.name, np.float64) for channel in AXIS_CHANNELS])
Rows = np.ndarray[Any, np.dtype[np.void]]
"""(n,) of `ROW`."""
POWERED_STATUSWORD = 0x0637
"""Operation enabled, voltage enabled, remote, target reached (CiA 402)."""
_NEVER = -1
BITS = tuple(EVENT_OF)
"""What supervision may find."""


class AxisRollout:
    """Simulates one axis piece by piece, each from the end of the previous one; advances `plant` in place.

    `plant`: all axes of `plant_config`.

    Raises:
        ValueError: the SYNC period is no whole number of substeps, or the axis depends on another one, but
            here each axis runs alone.

    """

    def __init__(
        self, machine: MachineConfig, plant_config: PlantConfig, axis: str, params: AxisParams, plant: Plant
    ) -> None:
        index, wires, parts = wired_axis(machine, plant_config, axis, params, plant)
        records, self._tables, kept = cycle_records([parts])
        store(records["sequence"], [switching_on(parts)])
        self._records, self._kept, self._wires = records, kept[0], wires
        self._plant = plant.params[index], plant.state[index], plant.setpoint[index]
        self._times = substeps_of(machine, plant_config), plant_config.dt_s
        self._origin = 0
        self._cycles = 0
        self._found_at = nothing_found()

    @property
    def findings(self) -> dict[Event, int]:
        """For what the daemon would have stopped: the first cycle of each event, counted from power-up."""
        return events_of(self._found_at)

    def change_params(self, params: AxisParams) -> None:
        """Change the parameters from the next cycle on."""
        self._tables = store(self._records["law"]["params"], [params])

    def rows(self, reference: Array, off_cycles: int = 0) -> Rows:
        """Return rows (n,) for the next commands (n, 4); the first `off_cycles` are without power."""
        rows = np.full((len(reference), AXIS_COLUMNS), np.nan)
        commands = np.ascontiguousarray(reference, dtype=np.float64)
        memory = self._records[0], self._tables, self._kept, self._wires, *self._plant, *self._times
        found_at = nothing_found()
        self._origin = _run_axis(*memory, commands, off_cycles, self._origin, rows, BITS, found_at)
        new = (self._found_at == _NEVER) & (found_at != _NEVER)
        self._found_at[new] = found_at[new] + self._cycles
        self._cycles += len(rows)
        return rows.view(ROW)[:, 0]


@kernel
def _take_effect(axis: Any, wires: Wires, sp: Any, origin: int) -> None:
    """Write set points of the bus into the plant's record, like the drive's cyclic modes."""
    output, sent = axis["law"]["params"]["output"], axis["law"]["counts"]
    sp.loop = output + 1
    if output == 0:
        total = min(max(sent["torque"] + sent["torque_offset"], -wires.max_torque), wires.max_torque)
        sp.current_a = total * wires.drive_ampere_per_torque
        sp.current_offset_a = 0.0
        return
    sp.current_offset_a = sent["torque_offset"] * wires.drive_ampere_per_torque
    if output == 1:
        sp.velocity_m_s = sent["velocity"] * wires.drive_metre_per_s_per_unit
        sp.velocity_offset_m_s = 0.0
    else:
        sp.position_m = (sent["position"] + origin) * wires.drive_metre_per_count
        sp.velocity_offset_m_s = sent["velocity_offset"] * wires.drive_metre_per_s_per_unit


@threaded_kernel  # several axes, machines or variants run at once in threads
def _run_axis(
    axis: Any,
    tables: Pool,
    kept: Array,
    wires: Wires,
    p: Any,
    s: Any,
    sp: Any,
    substeps: int,
    dt_s: float,
    reference: Array,
    off_cycles: int,
    origin: int,
    rows: Array,
    bits: Any,
    found_at: Index,
) -> int:
    """Fill `rows` and `found_at`; return the encoder counts at the axis's zero."""
    for k in range(len(reference)):
        advance_axis(p, s, sp, substeps, dt_s)
        origin = latch(axis, wires, p, s, sp, k >= off_cycles, origin)
        answer(
            axis, tables, kept, wires, sp, reference[k], k, k >= off_cycles, origin, rows[k], bits, found_at
        )
    return origin


@kernel
def latch(axis: Any, wires: Wires, p: Any, s: Any, sp: Any, power: bool, origin: int) -> int:
    """Latch the inputs of a plant that has come to its SYNC; return the encoder counts at the zero."""
    inputs = axis["inputs"]
    if axis["engaged"] and not wires.immediate:
        _take_effect(axis, wires, sp, origin)
    if power and not axis["engaged"]:
        origin = s.encoder_counts
    inputs["previous_motor_m"] = inputs["motor_m"]
    inputs["counts"] = s.encoder_counts - origin
    inputs["motor_m"] = inputs["counts"] * wires.metre_per_count
    permille = np.rint(s.current_measured_a * wires.drive_permille_per_ampere)
    inputs["current_a"] = permille * wires.ampere_per_permille
    if p.scale.enabled:
        inputs["scale_raw_m"] = s.scale_counts * wires.scale_metre_per_count
        inputs["scale_m"] = inputs["scale_raw_m"] + inputs["scale_offset_m"]
    return origin


@kernel
def answer(
    axis: Any,
    tables: Pool,
    kept: Array,
    wires: Wires,
    sp: Any,
    reference: Array,
    cycle: int,
    power: bool,
    origin: int,
    row: Array,
    bits: Any,
    found_at: Index,
) -> None:
    """Let the controller answer the latched inputs, make the row and note what supervision finds."""
    inputs = axis["inputs"]
    if not (power or axis["engaged"]):
        row[2], row[6] = inputs["motor_m"], inputs["current_a"]
        return
    inputs["statusword"] = POWERED_STATUSWORD
    step_axis(axis, tables, kept, True, reference, True, row)
    if axis["found"]:
        for place in range(len(bits)):
            if axis["found"] & bits[place] and found_at[place] == _NEVER:
                found_at[place] = cycle
    if wires.immediate:
        _take_effect(axis, wires, sp, origin)


def wired_axis(
    machine: MachineConfig, plant_config: PlantConfig, axis: str, params: AxisParams, plant: Plant
) -> tuple[int, Wires, AxisParts]:
    """Return the number of an axis in the plant, its scalings and what its record is made of.

    Raises ValueError where the plant of the axis depends on another one.
    """
    index = list(plant_config.axes).index(axis)
    if plant.params[index]["cross_axis_coupling"]["enabled"]:
        raise ValueError("cross_axis_coupling: in the batch twin each axis runs by itself, use the bus")
    wires = wires_of(machine.axes[axis], plant_config.axes[axis])
    plant.setpoint[index]["current_limit_a"] = wires.current_limit_a
    return index, wires, parts_of(machine.axes[axis], params, wires)


def switching_on(parts: AxisParts) -> Sequence:
    """Return the sequence of a drive that is told to switch on, and does where the power comes."""
    return Sequence(int(Phase.SWITCHING_ON), 0, parts.route.mode)


def nothing_found() -> Index:
    """Return the first cycle of each of `BITS`, before any."""
    return np.full(len(BITS), _NEVER)


def events_of(found_at: Index) -> dict[Event, int]:
    """Return the first cycle of each event that was found."""
    found: dict[Event, int] = {}
    for bit, cycle in zip(BITS, found_at.tolist(), strict=True):
        if cycle != _NEVER:
            found[EVENT_OF[bit]] = min(cycle, found.get(EVENT_OF[bit], cycle))
    return found
