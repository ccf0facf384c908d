"""Process settings for the cycle are restored afterwards; refused ones are reported."""

import ctypes
import gc
import os
import sys
from typing import Any

import pytest

from servo_ctrl.daemon.cycle import realtime
from servo_ctrl.daemon.cycle.realtime import RealtimeError, uninterrupted

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="SCHED_FIFO is Linux")


class Libc:
    """A C library that grants or refuses to lock memory, and counts."""

    def __init__(self, granted: bool) -> None:
        self.granted = granted
        self.locked = 0

    def mlockall(self, flags: int) -> int:
        assert flags == 7
        if not self.granted:
            ctypes.set_errno(1)
            return -1
        self.locked += 1
        return 0

    def munlockall(self) -> int:
        self.locked -= 1
        return 0


def pretend(monkeypatch: pytest.MonkeyPatch, libc: Libc, *, priority: bool) -> list[int]:
    """A system of our own; returns the scheduling policies that were set."""
    policies: list[int] = []

    def sched_setscheduler(pid: int, policy: int, parameter: Any) -> None:
        assert pid == 0
        if not priority:
            raise PermissionError(1, "Operation not permitted")
        policies.append(policy)

    monkeypatch.setattr(realtime.ctypes, "CDLL", lambda *_a, **_k: libc)
    monkeypatch.setattr(os, "sched_setscheduler", sched_setscheduler)
    return policies


def test_garbage_collector_is_paused_and_resumed() -> None:
    interval_s = sys.getswitchinterval()
    with uninterrupted(fifo=False, realtime=True):
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 0
        assert sys.getswitchinterval() < interval_s
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0
    assert sys.getswitchinterval() == interval_s


def test_garbage_collector_is_resumed_after_an_error() -> None:
    with pytest.raises(ValueError, match="under way"), uninterrupted(fifo=False, realtime=True):
        raise ValueError("under way")
    assert gc.isenabled()


def test_priority_and_memory_lock_are_set_and_released(monkeypatch: pytest.MonkeyPatch) -> None:
    libc = Libc(granted=True)
    policies = pretend(monkeypatch, libc, priority=True)
    with uninterrupted(fifo=True, realtime=True):
        assert (policies, libc.locked) == ([os.SCHED_FIFO], 1)
    assert (policies, libc.locked) == ([os.SCHED_FIFO, os.SCHED_OTHER], 0)


def test_refused_priority_is_reported_and_the_memory_unlocked(monkeypatch: pytest.MonkeyPatch) -> None:
    libc = Libc(granted=True)
    pretend(monkeypatch, libc, priority=False)
    with (
        pytest.raises(RealtimeError, match=r"--fifo: priority 80 is not permitted; needs CAP_SYS_NICE"),
        uninterrupted(fifo=True, realtime=True),
    ):
        pytest.fail("it was entered")
    assert libc.locked == 0
    assert gc.isenabled()


def test_refused_memory_lock_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend(monkeypatch, Libc(granted=False), priority=True)
    with (
        pytest.raises(RealtimeError, match=r"--fifo: mlockall: .*; needs CAP_IPC_LOCK"),
        uninterrupted(fifo=True, realtime=True),
    ):
        pytest.fail("it was entered")
