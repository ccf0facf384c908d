"""Lower priority for the threads beside a control cycle that has one."""

import os

BACKGROUND_PRIORITY = 1
"""Priority of other threads: above processes that could preempt a holder of the interpreter lock; chosen.

For the same reason such a thread is not nice under SCHED_OTHER.
"""


def lower_priority() -> None:
    """Lower the calling thread's priority below the cycle's, which it has inherited."""
    if hasattr(os, "sched_getscheduler") and os.sched_getscheduler(0) == os.SCHED_FIFO:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(BACKGROUND_PRIORITY))
