"""One cycle of an axis in the batch twin: what is latched at a SYNC, and what the controller makes of it.

The rollouts of one axis and of coupled axes (`axis_rollout`, `coupled_rollout`) advance the plant in between.
"""

from typing import Any

import numpy as np

from kernels.arrays import Array, Index
from kernels.jit import kernel
from kernels.record_layout import Pool
from servo_ctrl.axis.axis_watch import EVENT_OF
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.cyclic.axis_step import step_axis
from twin.bus_scaling import BusScaling

POWERED_STATUSWORD = 0x0637
"""Operation enabled, voltage enabled, remote, target reached (CiA 402)."""
NEVER = -1
"""First cycle of an event that has not occurred."""
EVENT_BITS = tuple(EVENT_OF)
"""Bits of the events that supervision may detect."""


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

    `event_cycles` (bits,) holds the first cycle of each event, NEVER before it.
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
            if axis["found"] & event_bits[event] and event_cycles[event] == NEVER:
                event_cycles[event] = cycle
    if scaling.immediate:
        _apply_set_points(axis, scaling, sp, origin)


def no_events() -> Index:
    """Return the first cycles (bits,) of the events of `EVENT_BITS` before any event."""
    return np.full(len(EVENT_BITS), NEVER)


def events_of(event_cycles: Index) -> dict[Event, int]:
    """Return the first cycle of each event that occurred; several bits may report one event."""
    events: dict[Event, int] = {}
    for bit, cycle in zip(EVENT_BITS, event_cycles.tolist(), strict=True):
        if cycle != NEVER:
            events[EVENT_OF[bit]] = min(cycle, events.get(EVENT_OF[bit], cycle))
    return events
