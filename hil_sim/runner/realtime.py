"""A priority and locked memory for a simulator whose answers must not come late."""

import ctypes
import os

FIFO_PRIORITY = 70
"""Below the controller's cycle (80), which it must not hold up on one processor. Chosen."""
MCL_ALL_ON_FAULT = 7
"""Of mlockall(2): what was touched once stays in memory, and libraries that nobody calls take none."""


class RealtimeError(Exception):
    """The system does not grant what --fifo asks for. `str()` is one line for the user."""


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
