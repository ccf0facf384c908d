"""A bus that is never idle: the simulator takes a bounded number of frames at once, and timers still run."""

from typing import Any

import can

from hil_sim.runner.can_port import FRAMES_PER_WAKE, CanPort


class Endless:
    """A bus that always has a received frame."""

    channel_info = "endless"

    def __init__(self, **flags: Any) -> None:
        self._message = can.Message(arbitration_id=0x181, is_extended_id=False, **flags)

    def recv(self, _timeout: float) -> can.Message:
        return self._message


def port_at(bus: Any) -> CanPort:
    return CanPort(bus)


def test_a_wake_up_ends_on_a_bus_that_is_never_idle() -> None:
    taken: list[int] = []
    port_at(Endless()).drain(lambda can_id, _data: taken.append(can_id))
    assert taken == FRAMES_PER_WAKE * [0x181]


def test_can_fd_frames_are_ignored() -> None:
    taken: list[int] = []
    port_at(Endless(is_fd=True, data=bytes(12))).drain(lambda can_id, _data: taken.append(can_id))
    assert taken == []
