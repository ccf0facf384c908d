"""`hil-sim run --fifo`: its system calls, and its message if the system refuses them."""

import ctypes
import os
from typing import Any

import pytest

from hil_sim.runner.realtime import RealtimeError, take_priority


class Libc:
    """The memory lock of a system that grants or refuses it."""

    def __init__(self, *, granted: bool) -> None:
        self.granted, self.flags = granted, 0

    def mlockall(self, flags: int) -> int:
        self.flags = flags
        return 0 if self.granted else -1


def pretend(monkeypatch: pytest.MonkeyPatch, libc: Libc, *, priority: bool) -> list[tuple[int, int]]:
    """Replace libc and the scheduler by fakes; return the requests to the scheduler."""
    asked: list[tuple[int, int]] = []

    def schedule(_pid: int, policy: int, given: Any) -> None:
        if not priority:
            raise PermissionError
        asked.append((policy, given.sched_priority))

    monkeypatch.setattr(ctypes, "CDLL", lambda *_arguments, **_options: libc)
    monkeypatch.setattr(os, "sched_setscheduler", schedule)
    return asked


def test_memory_is_locked_and_the_priority_is_below_the_cycle(monkeypatch: pytest.MonkeyPatch) -> None:
    libc = Libc(granted=True)
    asked = pretend(monkeypatch, libc, priority=True)
    take_priority()
    assert (asked, libc.flags) == ([(os.SCHED_FIFO, 70)], 7)


@pytest.mark.parametrize(
    ("granted", "reason"), [(False, "mlockall: .*CAP_IPC_LOCK"), (True, "priority 70 .*CAP_SYS_NICE")]
)
def test_what_is_refused_is_named(monkeypatch: pytest.MonkeyPatch, granted: bool, reason: str) -> None:
    pretend(monkeypatch, Libc(granted=granted), priority=False)
    with pytest.raises(RealtimeError, match=reason):
        take_priority()
