"""Lets a Python process keep a period: no garbage collection, a short slice or priority and locked memory."""

import ctypes
import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import numpy as np

from kernels.short_slice import short_slice
from servo_ctrl.errors import ServoCtrlError

FIFO_PRIORITY = 80
"""Priority of the cycle; chosen."""
SWITCH_INTERVAL_S = 2e-4
"""After this time another thread must return the interpreter lock to the cycle; chosen."""
MCL_ALL_ON_FAULT = 7
"""Flags of mlockall(2): a page stays in memory once it is touched; untouched libraries take none."""


class RealtimeError(ServoCtrlError):
    """The system does not permit what --fifo needs."""


@contextmanager
def uninterrupted(*, fifo: bool, realtime: bool) -> Iterator[None]:
    """Run the block without garbage collection, with `fifo` also under SCHED_FIFO with locked memory.

    In `realtime` without `fifo` the process has the shortest time slice.
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
        with short_slice() if realtime and not fifo else nullcontext():
            yield
    finally:
        sys.setswitchinterval(interval_s)
        gc.unfreeze()
        if collecting:
            gc.enable()
        if fifo:
            _restore_priority()


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
