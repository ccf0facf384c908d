"""Messages of a bus, sent and received by tests."""

from collections.abc import Callable
from typing import Any

import can

Attach = Callable[..., Any]
"""A fixture that attaches buses to a hub."""


def message(identifier: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=identifier, is_extended_id=False, data=data)


def receive(bus: can.BusABC, count: int, patience_s: float = 10.0) -> list[can.Message]:
    received = [bus.recv(patience_s) for _ in range(count)]
    assert None not in received
    return [frame for frame in received if frame is not None]
