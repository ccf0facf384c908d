"""The shortest time slice of SCHED_OTHER, for a process that computes briefly and often, as a cycle does.

Since version 6.12 Linux lets a task that wakes up run at once if its slice is shorter than the running one's.
Any user may shorten the own slice; sched(7), sched_setattr(2).
"""

import contextlib
import ctypes
import os
import platform
import struct
from collections.abc import Iterator

SLICE_NS = 100_000
"""The shortest slice that Linux takes (fair.c, `__setparam_fair`)."""
DEFAULT_SLICE = 0
"""Requests the slice of the system."""
SYSCALLS = {"x86_64": 314, "aarch64": 274}
"""Number of sched_setattr(2) by machine; the C library of Debian 12 has no function for it."""
LAYOUT = struct.Struct("@IIQiIQQQ")
"""struct sched_attr: size, policy, flags, niceness, priority, slice (runtime), deadline, period."""


@contextlib.contextmanager
def short_slice() -> Iterator[None]:
    """Run the block with the shortest slice, then with the system's.

    Nothing changes under any other policy, where a sandbox forbids it, before 6.12, and outside Linux.
    """
    changed = _set_slice(SLICE_NS)
    try:
        yield
    finally:
        if changed:
            _set_slice(DEFAULT_SLICE)


def _set_slice(slice_ns: int) -> bool:
    """Return whether the system took it."""
    number = SYSCALLS.get(platform.machine())
    if number is None or not hasattr(os, "sched_getscheduler") or os.sched_getscheduler(0) != os.SCHED_OTHER:
        return False
    niceness = os.getpriority(os.PRIO_PROCESS, 0)
    attributes = LAYOUT.pack(LAYOUT.size, os.SCHED_OTHER, 0, niceness, 0, slice_ns, 0, 0)
    answer: int = ctypes.CDLL(None).syscall(number, 0, ctypes.c_char_p(attributes), 0)
    return answer == 0
