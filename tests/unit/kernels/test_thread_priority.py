"""Threads beside a cycle with a priority give way to it."""

import os

import pytest

from kernels.thread_priority import lower_priority

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="scheduling policies are Linux")


def test_thread_drops_the_inherited_priority_of_the_cycle(monkeypatch: pytest.MonkeyPatch) -> None:
    priorities: list[int] = []
    monkeypatch.setattr(os, "sched_getscheduler", lambda _pid: os.SCHED_FIFO)
    monkeypatch.setattr(
        os, "sched_setscheduler", lambda _pid, _policy, given: priorities.append(given.sched_priority)
    )
    lower_priority()
    assert priorities == [1]
    monkeypatch.setattr(os, "sched_getscheduler", lambda _pid: os.SCHED_OTHER)
    lower_priority()
    assert priorities == [1]
