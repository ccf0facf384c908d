"""A servo controller for CANopen drives (CiA 402) and linear scales (CiA 406)."""

import importlib
import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from servo_ctrl.client.blocking import Client
    from servo_ctrl.client.client import AsyncClient, CommandRefusedError
    from servo_ctrl.errors import ServoCtrlError

# Before Arrow is imported: its own allocator reserves 1 GiB, which --fifo would make resident (mlockall).
os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")

__all__ = ["AsyncClient", "Client", "CommandRefusedError", "ServoCtrlError"]

_HOMES = {
    "AsyncClient": "servo_ctrl.client.client",
    "Client": "servo_ctrl.client.blocking",
    "CommandRefusedError": "servo_ctrl.client.client",
    "ServoCtrlError": "servo_ctrl.errors",
}
"""Where the public names live: loaded when first used, for importing the package must stay light."""


def __getattr__(name: str) -> Any:
    """Load a public name."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
