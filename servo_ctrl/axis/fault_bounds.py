"""How soon the machine reacts: SYNC periods in which the reactions of `fault_policy` take effect.

Two numbers an event. *Detection*: from the first cycle in which the cause is present, which the page names
under *when* (docs/fault_policy.md; of a runaway the motion against the push, not the wrong sign behind it),
to the cycle in which it is an event; limits of the machine file decide that. *Reaction*: from that cycle to
the one whose RPDOs carry the new controlword, or the first set point of the ramp; that follows from the
daemon's design. A drive acts on an RPDO at the next SYNC.
"""

import math

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.supervision import runaway_cycles, saturation_cycles
from servo_ctrl.canopen.settings import HEARTBEATS_MISSED
from servo_ctrl.config.model import MachineConfig

_READ = 1  # seen in the inputs of a cycle, while its RPDOs are being made: the next ones carry the reaction
_FRAME = 2  # a frame of its own: it may come behind the inputs, when those of the next cycle are waited for

BOUND_CYCLES: dict[Event, int] = {
    Event.LOST_TPDO: _READ,
    Event.LATE_TICK: _READ,
    Event.LOST_HEARTBEAT: _FRAME,
    Event.EMCY: _FRAME,
    Event.DRIVE_FAULT: _READ,
    Event.FOLLOWING_ERROR: _READ,
    Event.LIMIT: _READ,
    Event.LIMIT_SWITCH: _FRAME,
    Event.SENSORS_DISAGREE: _READ,
    Event.RUNAWAY: _READ,
    Event.SATURATED: _READ,
    Event.BAD_COMMAND: _READ,
    Event.BAD_PROGRAM: _READ,
    Event.FOREIGN_MASTER: _FRAME,
    Event.DUPLICATE_NODE: _FRAME,
    Event.WRONG_PDO: _FRAME,
    Event.OBJECT_CHANGED: _FRAME,
    Event.FRAMES_LOST: _FRAME,
    Event.BUS_DOWN: 0,  # nothing can be sent any more; the drives miss our heartbeat
    Event.STOP_SIGNAL: _FRAME,
    Event.DISABLE: _FRAME,
    Event.QUICK_STOP: _FRAME,
}
"""Reaction: cycles from the event to RPDOs that carry it."""

GAP_TOLERATED_S = 0.02
"""In real time: how long ticks, or a node's inputs, may be missing (chosen). Axes keep their set points."""


def detection_cycles(machine: MachineConfig, *, lockstep: bool) -> dict[Event, int]:
    """Detection: cycles from the cause to the event; those not named are events in the cycle they show in."""
    period_s = machine.period_s
    gap = math.ceil(GAP_TOLERATED_S / period_s) + 1
    heartbeat = max(round(machine.controller.heartbeat_ms * 1e-3 / period_s), 1)
    axes = machine.axes.values()
    runaway = max(runaway_cycles(axis, period_s) for axis in axes)
    saturation = max(saturation_cycles(axis, period_s) for axis in axes)
    switches = max(axis.drive.limit_switch_syncs for axis in axes)
    return {
        Event.LIMIT_SWITCH: max(switches, 1),
        Event.RUNAWAY: 3 * runaway,  # braked: two blocks, and one that had begun before; led: sooner
        Event.SATURATED: saturation,
        Event.DUPLICATE_NODE: 4,  # at rest; 2 where the two say different things in motion
        Event.LOST_TPDO: 1 if lockstep else gap,
        Event.LATE_TICK: gap,
        Event.LOST_HEARTBEAT: (HEARTBEATS_MISSED + 2) * heartbeat,  # checked once a heartbeat time
    }


def drive_alone_cycles(machine: MachineConfig) -> int:
    """Cycles after which a drive that receives no heartbeat of ours brakes by itself (1016h, 6007h)."""
    return math.ceil(machine.controller.heartbeat_ms * HEARTBEATS_MISSED * 1e-3 / machine.period_s) + 1
