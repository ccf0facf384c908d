"""The reaction of the machine to each event in each stage, as one table.

All axes react together, because a machine whose axes stop one by one leaves its contour.
"""

from enum import Enum, IntEnum

from servo_ctrl.commands.stage import Stage


class Event(Enum):
    """A fault, or a request to stop, while the machine is on."""

    LOST_TPDO = "inputs missing"
    LATE_TICK = "tick too late"
    LOST_HEARTBEAT = "heartbeat missing"
    EMCY = "emergency message"
    DRIVE_FAULT = "drive fault"
    FOLLOWING_ERROR = "following error"
    LIMIT = "position limit"
    LIMIT_SWITCH = "limit switch"
    SENSORS_DISAGREE = "scale and encoder disagree"
    RUNAWAY = "axis runs away"
    SATURATED = "current saturated"
    BAD_COMMAND = "set point is not a number"
    BAD_PROGRAM = "program refused"
    FOREIGN_MASTER = "another controller"
    DUPLICATE_NODE = "duplicate node"
    WRONG_PDO = "PDO of another length"
    OBJECT_CHANGED = "object of a node changed"
    FRAMES_LOST = "frames lost on the bus"
    BUS_OFF = "bus off"
    """Our interface has left the bus, and may be restarted."""
    BUS_DOWN = "bus down"
    STOP_SIGNAL = "stop signal"
    """SIGINT or SIGTERM: the run ends."""
    DISABLE = "switched off"
    """Switched off by the operator."""
    QUICK_STOP = "quick stop"
    """Quick stop by the operator."""


class Reaction(IntEnum):
    """Reactions in order of severity."""

    NONE = 0
    HOLD = 1
    """Controlled stop, then power off."""
    QUICK_STOP = 2
    CUT_OFF = 3
    """Power off at once for the axis of the event; the other drives brake by themselves."""
    DISABLE = 4
    """Power off at once."""


_NONE, _HOLD, _QUICK, _CUT, _OFF = Reaction
_UNDER_CONTROL = {
    Event.LOST_TPDO: _QUICK,  # without inputs the controller cannot ramp the axis down
    Event.LATE_TICK: _HOLD,
    Event.LOST_HEARTBEAT: _HOLD,
    Event.EMCY: _HOLD,
    Event.DRIVE_FAULT: _HOLD,  # the faulted drive brakes by itself; the others come to rest with it
    Event.FOLLOWING_ERROR: _QUICK,  # the axis no longer follows its set points
    Event.LIMIT: _HOLD,
    Event.LIMIT_SWITCH: _QUICK,  # a switch lies beyond the software limit, so the home position must be wrong
    Event.SENSORS_DISAGREE: _QUICK,  # one of the two is wrong; the drive brakes by its own sensor
    Event.RUNAWAY: _CUT,  # any loop closed on this axis drives it further
    Event.SATURATED: _HOLD,
    Event.BAD_COMMAND: _QUICK,  # a ramp down would start from the bad set point
    Event.BAD_PROGRAM: _HOLD,
    Event.FOREIGN_MASTER: _QUICK,  # two masters on one bus: set points and SYNC are not ours alone
    Event.DUPLICATE_NODE: _QUICK,  # the position read may be that of either node
    Event.WRONG_PDO: _QUICK,  # the inputs are unreliable: the mapping is not the configured one
    Event.OBJECT_CHANGED: _HOLD,
    Event.FRAMES_LOST: _HOLD,
    Event.BUS_OFF: _QUICK,  # no frame reaches the drives until the bus is back; then they brake
    Event.BUS_DOWN: _OFF,
    Event.STOP_SIGNAL: _HOLD,
    Event.DISABLE: _HOLD,
    Event.QUICK_STOP: _QUICK,
}
_ENDING = {**dict.fromkeys(Event, _NONE), Event.BUS_DOWN: _OFF}

REACTIONS: dict[Stage, dict[Event, Reaction]] = {
    Stage.BOOTING: {**_ENDING, Event.STOP_SIGNAL: _OFF},
    Stage.STARTING: {
        Event.LOST_TPDO: _QUICK,
        Event.LATE_TICK: _NONE,  # the controller moves no axis yet
        Event.LOST_HEARTBEAT: _QUICK,
        Event.EMCY: _NONE,  # an old fault may send EMCY until its reset; switching on is bounded in time
        Event.DRIVE_FAULT: _QUICK,
        Event.FOLLOWING_ERROR: _QUICK,
        Event.LIMIT: _NONE,  # homing may pass the limits
        Event.LIMIT_SWITCH: _NONE,  # and searches for the switches
        Event.SENSORS_DISAGREE: _QUICK,
        Event.RUNAWAY: _CUT,
        Event.SATURATED: _QUICK,
        Event.BAD_COMMAND: _QUICK,
        Event.BAD_PROGRAM: _NONE,
        Event.FOREIGN_MASTER: _QUICK,
        Event.DUPLICATE_NODE: _QUICK,
        Event.WRONG_PDO: _QUICK,
        Event.OBJECT_CHANGED: _QUICK,
        Event.FRAMES_LOST: _QUICK,
        Event.BUS_OFF: _QUICK,
        Event.BUS_DOWN: _OFF,
        Event.STOP_SIGNAL: _QUICK,
        Event.DISABLE: _QUICK,
        Event.QUICK_STOP: _QUICK,
    },
    Stage.READY: _UNDER_CONTROL,
    Stage.RUNNING: _UNDER_CONTROL,
    Stage.STOPPING: {
        **_ENDING,
        Event.LOST_TPDO: _QUICK,
        Event.FOLLOWING_ERROR: _QUICK,
        Event.LIMIT_SWITCH: _QUICK,
        Event.SENSORS_DISAGREE: _QUICK,
        Event.RUNAWAY: _CUT,
        Event.BAD_COMMAND: _QUICK,
        Event.FOREIGN_MASTER: _QUICK,
        Event.DUPLICATE_NODE: _QUICK,
        Event.WRONG_PDO: _QUICK,
        Event.BUS_OFF: _QUICK,
        Event.STOP_SIGNAL: _QUICK,  # a second signal stops faster
        Event.QUICK_STOP: _QUICK,
    },
    Stage.QUICK_STOPPING: {**_ENDING, Event.RUNAWAY: _CUT, Event.STOP_SIGNAL: _OFF},
    Stage.DISABLING: _ENDING,
    Stage.OFF: {**_ENDING, Event.BUS_DOWN: _NONE},
    Stage.STANDBY: {**_ENDING, Event.STOP_SIGNAL: _OFF, Event.FOREIGN_MASTER: _OFF},
}

REQUESTS = frozenset({Event.STOP_SIGNAL, Event.DISABLE, Event.QUICK_STOP})
"""Events that do not make the run a failed one."""
ENDS_THE_RUN = frozenset({Event.STOP_SIGNAL, Event.BUS_DOWN, Event.FOREIGN_MASTER})
"""Events that end the run; after any other stop a run that may stand by does so."""


def reaction(stage: Stage, event: Event) -> Reaction:
    """Return the reaction of the machine to an event."""
    return REACTIONS[stage][event]
