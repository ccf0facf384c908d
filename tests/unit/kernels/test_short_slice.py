"""The time slice of a process is shortened for a block; read back with sched_getattr(2)."""

import ctypes
import os
import platform
import struct

import pytest

from kernels.short_slice import SLICE_NS, short_slice

GETATTR = {"x86_64": 315, "aarch64": 275}
LINUX_WITH_SLICES = (6, 12)


def slice_ns() -> int:
    """The slice as Linux has it."""
    buffer = ctypes.create_string_buffer(48)
    assert ctypes.CDLL(None).syscall(GETATTR[platform.machine()], 0, buffer, 48, 0) == 0
    return int(struct.unpack_from("@IIQiIQ", buffer.raw)[5])


@pytest.mark.skipif(
    platform.machine() not in GETATTR
    or tuple(int(part) for part in platform.release().split(".")[:2]) < LINUX_WITH_SLICES,
    reason="needs Linux 6.12",
)
def test_slice_is_the_shortest_within_the_block_and_the_system_s_again_after_it() -> None:
    before, niceness = slice_ns(), os.getpriority(os.PRIO_PROCESS, 0)
    with short_slice():
        assert slice_ns() == SLICE_NS < before
        assert os.getpriority(os.PRIO_PROCESS, 0) == niceness
    assert slice_ns() == before


def test_other_policies_and_unknown_machines_are_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda _name: pytest.fail("the system was asked"))
    monkeypatch.setattr(platform, "machine", lambda: "a machine of tomorrow")
    with short_slice():
        pass


def test_a_process_with_a_priority_keeps_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getscheduler", lambda _pid: os.SCHED_FIFO)
    monkeypatch.setattr(ctypes, "CDLL", lambda _name: pytest.fail("the system was asked"))
    with short_slice():
        pass
