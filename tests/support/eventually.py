"""Waiting for what another process does, as long as it may take on a busy machine, and no longer."""

import time
from collections.abc import Callable
from typing import TypeVar

Seen = TypeVar("Seen")
LIMIT_S = 30.0


def eventually(look: Callable[[], Seen], wanted: Seen) -> None:
    """What `look` sees becomes `wanted`."""
    deadline_s = time.monotonic() + LIMIT_S
    while (seen := look()) != wanted and time.monotonic() < deadline_s:
        time.sleep(0.05)
    assert seen == wanted
