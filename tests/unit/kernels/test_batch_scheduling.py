"""SCHED_BATCH holds for a block alone, and only where the process had no other policy."""

import os
from collections.abc import Iterator
from typing import Any

import pytest

from kernels.batch_scheduling import batch_scheduling


@pytest.fixture(autouse=True)
def other() -> Iterator[None]:
    """Begin with SCHED_OTHER, and give the test's process its policy back."""
    before = os.sched_getscheduler(0)
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    yield
    os.sched_setscheduler(0, before, os.sched_param(0))


def test_the_policy_is_restored_also_after_a_failure() -> None:
    inside = []

    def fail() -> None:
        inside.append(os.sched_getscheduler(0))
        raise ValueError("ended")

    with pytest.raises(ValueError, match="ended"), batch_scheduling():
        fail()
    assert (inside, os.sched_getscheduler(0)) == ([os.SCHED_BATCH], os.SCHED_OTHER)


def test_a_process_that_was_batch_before_stays_batch() -> None:
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    with batch_scheduling():
        pass
    assert os.sched_getscheduler(0) == os.SCHED_BATCH


def test_a_sandbox_that_forbids_the_policy_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []

    def refuse(_pid: int, policy: int, _param: Any) -> None:
        calls.append(policy)
        raise PermissionError

    with monkeypatch.context() as patch:
        patch.setattr(os, "sched_setscheduler", refuse)
        with batch_scheduling():
            assert os.sched_getscheduler(0) == os.SCHED_OTHER
    assert calls == [os.SCHED_BATCH]
