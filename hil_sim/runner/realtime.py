"""Real-time priority and locked memory for a simulator whose answers must not be late."""

import ctypes
import os

FIFO_PRIORITY = 70
"""Below the controller's cycle (80), which it must not delay on one processor. Chosen."""
MCL_ALL_ON_FAULT = 7
"""Flags of mlockall(2): pages stay in memory from their first use on; unused pages of libraries need none."""


class RealtimeError(Exception):
    """The system refuses what --fifo requests. `str()` is one line for the user."""


def take_priority() -> None:
    """Lock the memory of this process and run its thread as SCHED_FIFO, until it ends.

    Raises:
        RealtimeError: one of them is not permitted.
    """
    if not hasattr(os, "sched_setscheduler"):
        raise RealtimeError("--fifo needs Linux (sched_setscheduler)")
    if ctypes.CDLL(None, use_errno=True).mlockall(MCL_ALL_ON_FAULT) != 0:
        reason = os.strerror(ctypes.get_errno())
        raise RealtimeError(f"--fifo: mlockall: {reason}; needs CAP_IPC_LOCK or a higher `ulimit -l`")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except PermissionError:
        raise RealtimeError(
            f"--fifo: priority {FIFO_PRIORITY} is not permitted; needs CAP_SYS_NICE or a higher `ulimit -r`"
        ) from None
