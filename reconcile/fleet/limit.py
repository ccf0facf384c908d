"""A time limit for work in the calling thread."""

import ctypes
import threading
import time
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")
PENDING_STEPS = 20
"""Milliseconds of Python steps within which an exception that was already sent is certainly raised."""


class TimeLimitError(Exception):
    """The work took longer than allowed."""


class _TimeUp(BaseException):
    """Raised in the working thread by the timer; `except Exception` in the work does not catch it."""


def run_with_time_limit(
    work: Callable[[], Result], limit_s: float, on_stuck: Callable[[], None], grace_s: float
) -> Result:
    """Return the result of `work`. Raises TimeLimitError after `limit_s`, at the next step of Python.

    Compiled code that does not return to Python cannot be interrupted in this way: for it `on_stuck` is
    called after another `grace_s`.
    """
    timer = _Timer(limit_s, on_stuck, grace_s)
    try:
        timer.start()
        try:
            return work()
        finally:
            timer.stop()
    except _TimeUp:
        timer.over.set()  # the exception may have interrupted `stop` before it did this
        raise TimeLimitError(f"took longer than {limit_s:g} s") from None


class _Timer:
    """A thread that interrupts the one that created it."""

    def __init__(self, limit_s: float, on_stuck: Callable[[], None], grace_s: float) -> None:
        self._owner = threading.get_ident()
        self._limit_s, self._grace_s, self._on_stuck = limit_s, grace_s, on_stuck
        self._lock, self.over = threading.Lock(), threading.Event()
        self._raised = False
        self._thread = threading.Thread(target=self._run, name="time limit of an axis", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Return once no interruption can follow; one that was sent is raised within this call."""
        with self._lock:
            self.over.set()
            raised = self._raised
        for _ in range(PENDING_STEPS if raised else 0):
            time.sleep(1e-3)

    def _run(self) -> None:
        if self.over.wait(self._limit_s):
            return
        with self._lock:
            if self.over.is_set():
                return
            self._raised = True
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._owner), ctypes.py_object(_TimeUp))
        if not self.over.wait(self._grace_s):
            self._on_stuck()
