"""Threads beside the cycle give way to it, whatever its policy."""

import os
import threading

import pytest

from kernels.thread_priority import BACKGROUND_NICENESS, lower_priority

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="scheduling policies are Linux")


def test_thread_drops_the_inherited_priority_of_the_cycle(monkeypatch: pytest.MonkeyPatch) -> None:
    priorities: list[int] = []
    monkeypatch.setattr(os, "sched_getscheduler", lambda _pid: os.SCHED_FIFO)
    monkeypatch.setattr(
        os, "sched_setscheduler", lambda _pid, _policy, given: priorities.append(given.sched_priority)
    )
    lower_priority()
    assert priorities == [1]


def test_thread_of_an_ordinary_process_is_nice_and_the_process_is_not() -> None:
    before, niceness = os.getpriority(os.PRIO_PROCESS, 0), []

    def work() -> None:
        lower_priority()
        niceness.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id()))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert niceness == [BACKGROUND_NICENESS]
    assert os.getpriority(os.PRIO_PROCESS, os.getpid()) == before


def test_thread_that_is_nicer_already_stays_so() -> None:
    niceness = []

    def work() -> None:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), BACKGROUND_NICENESS + 5)
        lower_priority()
        niceness.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id()))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert niceness == [BACKGROUND_NICENESS + 5]
