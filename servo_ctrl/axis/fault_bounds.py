"""Bounds, in SYNC periods, on the time in which the reactions of `fault_policy` take effect.

Each event has two bounds. *Detection* lasts from the first cycle with the cause, which docs/fault_policy.md
names under *when* (for a runaway the motion against the push, not the wrong sign behind it), to the cycle of
the event; limits in the machine file determine it. *Reaction* lasts from that cycle to the cycle whose RPDOs
carry the new controlword or the first set point of the ramp; the daemon's design determines it. A drive acts
on an RPDO at the next SYNC.
"""

import math

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.supervision import runaway_cycles, saturation_cycles
from servo_ctrl.canopen.settings import HEARTBEATS_MISSED
from servo_ctrl.config.model import MachineConfig

_IN_INPUTS = 1  # found in a cycle's inputs after its RPDOs were computed: the next RPDOs carry the reaction
_IN_FRAME = 2  # a separate frame, which may arrive after the cycle's inputs and then waits for the next cycle

BOUND_CYCLES: dict[Event, int] = {
    Event.LOST_TPDO: _IN_INPUTS,
    Event.LATE_TICK: _IN_INPUTS,
    Event.LOST_HEARTBEAT: _IN_FRAME,
    Event.EMCY: _IN_FRAME,
    Event.DRIVE_FAULT: _IN_INPUTS,
    Event.FOLLOWING_ERROR: _IN_INPUTS,
    Event.LIMIT: _IN_INPUTS,
    Event.LIMIT_SWITCH: _IN_FRAME,
    Event.SENSORS_DISAGREE: _IN_INPUTS,
    Event.RUNAWAY: _IN_INPUTS,
    Event.SATURATED: _IN_INPUTS,
    Event.BAD_COMMAND: _IN_INPUTS,
    Event.BAD_PROGRAM: _IN_INPUTS,
    Event.FOREIGN_MASTER: _IN_FRAME,
    Event.DUPLICATE_NODE: _IN_FRAME,
    Event.WRONG_PDO: _IN_FRAME,
    Event.OBJECT_CHANGED: _IN_FRAME,
    Event.FRAMES_LOST: _IN_FRAME,
    Event.BUS_OFF: 0,  # no frame can be sent; the drives stop because our heartbeat is missing
    Event.BUS_DOWN: 0,  # the same, for good
    Event.STOP_SIGNAL: _IN_FRAME,
    Event.DISABLE: _IN_FRAME,
    Event.QUICK_STOP: _IN_FRAME,
}
"""Reaction: cycles from the event to the RPDOs that carry the reaction."""

GAP_TOLERATED_S = 0.02
"""Longest tolerated gap of ticks or of a node's inputs in real time; axes keep their set points. Chosen."""


def detection_cycles(machine: MachineConfig, *, lockstep: bool) -> dict[Event, int]:
    """Return the detection time in cycles; an event not listed is detected in the cycle of its cause."""
    period_s = machine.period_s
    gap = math.ceil(GAP_TOLERATED_S / period_s) + 1
    heartbeat = max(round(machine.controller.heartbeat_ms * 1e-3 / period_s), 1)
    axes = machine.axes.values()
    runaway = max(runaway_cycles(axis, period_s) for axis in axes)
    saturation = max(saturation_cycles(axis, period_s) for axis in axes)
    switches = max(axis.drive.limit_switch_syncs for axis in axes)
    return {
        Event.LIMIT_SWITCH: max(switches, 1),
        Event.RUNAWAY: 3 * runaway,  # while the drive brakes: two whole blocks after an incomplete one
        Event.SATURATED: saturation,
        Event.DUPLICATE_NODE: 4,  # at rest; 2 in motion, where the two nodes send different values
        Event.LOST_TPDO: 1 if lockstep else gap,
        Event.LATE_TICK: gap,
        Event.LOST_HEARTBEAT: (HEARTBEATS_MISSED + 2) * heartbeat,  # checked once every heartbeat time
    }


def drive_alone_cycles(machine: MachineConfig) -> int:
    """Return the cycles after which a drive without our heartbeat brakes by itself (1016h, 6007h)."""
    return math.ceil(machine.controller.heartbeat_ms * HEARTBEATS_MISSED * 1e-3 / machine.period_s) + 1
