"""A bound on how long a piece of work may take in the thread that it runs in."""

from __future__ import annotations

import ctypes
import threading
import time
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

Result = TypeVar("Result")
STEPS = 20


class OverTimeError(Exception):
    """The work took longer than it may."""


class _TimeUp(BaseException):
    """Put into the thread from outside; no `except Exception` of the work holds it."""


def bounded(
    work: Callable[[], Result], limit_s: float, on_stuck: Callable[[], None], grace_s: float
) -> Result:
    """The result of `work`. Raises OverTimeError after `limit_s`, at the next step of Python.

    Code that never comes back to Python cannot be ended so: `on_stuck` is called `grace_s` later.
    """
    watch = _Watch(limit_s, on_stuck, grace_s)
    try:
        watch.start()
        try:
            return work()
        finally:
            watch.stop()
    except _TimeUp:
        watch.over.set()  # it may have come before `stop` did so
        raise OverTimeError(f"took longer than {limit_s:g} s") from None


class _Watch:
    """A timer beside one call."""

    def __init__(self, limit_s: float, on_stuck: Callable[[], None], grace_s: float) -> None:
        self._owner = threading.get_ident()
        self._limit_s, self._grace_s, self._on_stuck = limit_s, grace_s, on_stuck
        self._lock, self.over = threading.Lock(), threading.Event()
        self._raised = False
        self._thread = threading.Thread(target=self._run, name="time limit of an axis", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """After it nothing is raised any more; what was is raised here at the latest."""
        with self._lock:
            self.over.set()
            raised = self._raised
        for _ in range(STEPS if raised else 0):  # the next step of Python raises it, if none has yet
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
