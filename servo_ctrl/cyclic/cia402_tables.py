"""The tables of `cia402` as arrays and ints for compiled functions, which take no enumeration.

A state is its place among `DriveState`, a goal its place among `Goal`.
"""

import numpy as np

from servo_ctrl.cyclic.cia402 import CONTROLWORD_TOWARDS, DriveState, Goal, Homing, drive_state, homing_status

_STATES = tuple(DriveState)
NOT_READY = _STATES.index(DriveState.NOT_READY_TO_SWITCH_ON)
SWITCHED_ON = _STATES.index(DriveState.SWITCHED_ON)
OPERATION_ENABLED = _STATES.index(DriveState.OPERATION_ENABLED)
QUICK_STOP_ACTIVE = _STATES.index(DriveState.QUICK_STOP_ACTIVE)
FAULT_REACTION_ACTIVE = _STATES.index(DriveState.FAULT_REACTION_ACTIVE)

STATE_OF = np.array([_STATES.index(drive_state(low)) for low in range(0x80)])
"""(128,) state by the low seven bits of the statusword."""
POWERED = np.isin(np.arange(len(_STATES)), [OPERATION_ENABLED, QUICK_STOP_ACTIVE, FAULT_REACTION_ACTIVE])
"""By state: whether the motor has current."""

ENABLED, DISABLED, QUICK_STOPPED = (tuple(Goal).index(goal) for goal in Goal)
CONTROLWORD = np.array([[CONTROLWORD_TOWARDS[goal][state] for state in _STATES] for goal in Goal])
"""(goals, states) controlword of the next move towards a goal."""

COMPLETED, ATTAINED_MOVING = Homing.COMPLETED.value, Homing.ATTAINED_MOVING.value
ERROR, ERROR_MOVING = Homing.ERROR.value, Homing.ERROR_MOVING.value
HOMING_PROGRESS = np.array([homing_status(bits << 10).value for bits in range(0x10)])
"""(16,) progress of homing by bits 10 to 13 of the statusword."""
