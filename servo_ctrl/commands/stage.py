"""Stages of the machine: the states of `axis.fault_policy`, and what object 2000h tells."""

from enum import IntEnum


class Stage(IntEnum):
    """What the machine as a whole is doing; the controller's object 2000h."""

    BOOTING = 0
    STARTING = 1
    """Drives are switched on and homed; the drives move the axes, not we."""
    READY = 2
    RUNNING = 3
    STOPPING = 4
    """Controlled stop: our references ramp down, all axes in the same time."""
    QUICK_STOPPING = 5
    """The drives brake by themselves (605Ah, 6085h)."""
    DISABLING = 6
    OFF = 7
    STANDBY = 8
    """Off, and the cycle goes on: until ENABLE, or a signal."""
