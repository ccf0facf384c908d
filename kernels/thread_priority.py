"""Lower priority for the threads beside a control cycle: writers of files, long computations."""

import os
import threading

BACKGROUND_PRIORITY = 1
"""Priority under SCHED_FIFO: above processes that could preempt a holder of the interpreter lock; chosen."""
BACKGROUND_NICENESS = 10
"""Niceness under SCHED_OTHER: among equals one that has slept long runs on for milliseconds; chosen."""


def lower_priority() -> None:
    """Lower the calling thread's priority below the cycle's, which it has inherited."""
    if not hasattr(os, "sched_getscheduler"):
        return
    if os.sched_getscheduler(0) == os.SCHED_FIFO:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(BACKGROUND_PRIORITY))
    else:
        thread = threading.get_native_id()
        niceness = max(BACKGROUND_NICENESS, os.getpriority(os.PRIO_PROCESS, thread))  # less is not permitted
        os.setpriority(os.PRIO_PROCESS, thread, niceness)
