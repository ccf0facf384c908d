"""Lets a Python process keep a period: no garbage collection, no page faults, optional priority."""

import ctypes
import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from servo_ctrl.errors import ServoCtrlError

FIFO_PRIORITY = 80
"""Priority of the cycle; chosen."""
BACKGROUND_PRIORITY = 1
"""Priority of other threads: above processes that could preempt a holder of the interpreter lock; chosen."""
SWITCH_INTERVAL_S = 2e-4
"""After this time another thread must return the interpreter lock to the cycle; chosen."""
MCL_ALL_ON_FAULT = 7
"""Flags of mlockall(2): a page stays in memory once it is touched; untouched libraries take none."""


class RealtimeError(ServoCtrlError):
    """The system does not permit what --fifo needs."""


@contextmanager
def uninterrupted(*, fifo: bool) -> Iterator[None]:
    """Run the block without garbage collection, with `fifo` also under SCHED_FIFO with locked memory.

    Objects allocated before are frozen out of the collector after collecting the young generations only: a
    full collection takes a tenth of a second.
    Raises RealtimeError when `fifo` is not permitted.
    """
    collecting, interval_s = gc.isenabled(), sys.getswitchinterval()
    if fifo:
        _raise_priority()
    gc.collect(1)
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    try:
        yield
    finally:
        sys.setswitchinterval(interval_s)
        gc.unfreeze()
        if collecting:
            gc.enable()
        if fifo:
            _restore_priority()


def lower_priority() -> None:
    """Lower the calling thread's priority below the cycle's, which it has inherited."""
    if hasattr(os, "sched_getscheduler") and os.sched_getscheduler(0) == os.SCHED_FIFO:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(BACKGROUND_PRIORITY))


def _raise_priority() -> None:
    if not hasattr(os, "sched_setscheduler"):
        raise RealtimeError("--fifo needs Linux (sched_setscheduler)")
    # Linear algebra allocates its buffers at its first call: tens of milliseconds once memory is locked.
    np.linalg.lstsq(np.eye(64), np.ones((64, 8)), rcond=None)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(MCL_ALL_ON_FAULT) != 0:
        reason = os.strerror(ctypes.get_errno())
        raise RealtimeError(f"--fifo: mlockall: {reason}; needs CAP_IPC_LOCK or a higher `ulimit -l`")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except PermissionError:
        libc.munlockall()
        raise RealtimeError(
            f"--fifo: priority {FIFO_PRIORITY} is not permitted; needs CAP_SYS_NICE or a higher `ulimit -r`"
        ) from None


def _restore_priority() -> None:
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    ctypes.CDLL(None).munlockall()
