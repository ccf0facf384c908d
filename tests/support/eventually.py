"""Waits for a value that another process changes, with a bound that suits a busy machine."""

import time
from collections.abc import Callable
from typing import TypeVar

Value = TypeVar("Value")
LIMIT_S = 30.0


def eventually(read: Callable[[], Value], wanted: Value) -> None:
    """Assert that `read()` becomes `wanted` within `LIMIT_S`."""
    deadline_s = time.monotonic() + LIMIT_S
    while (value := read()) != wanted and time.monotonic() < deadline_s:
        time.sleep(0.05)
    assert value == wanted
