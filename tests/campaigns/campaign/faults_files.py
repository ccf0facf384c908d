"""Faults of the input files of a run: changed, damaged or deleted during the run."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tests.campaigns.campaign.fault_context import WIRED, Fault
from tests.campaigns.campaign.machine import clear_eds_cache

if TYPE_CHECKING:
    from pathlib import Path

    from tests.campaigns.campaign.fault_context import FaultContext

DETECTION_MAX_S = 10.0
WATCHER_THREAD = "changed files"


def machine_file_changed(context: FaultContext) -> None:
    """The machine file is edited, damaged or deleted."""
    _change(context, context.stand.machine.controller.source, "kv_n_s_m = 14700.0", "kv_n_s_m = 14.0")


def eds_changed(context: FaultContext) -> None:
    """An EDS of the controller, a drive or a scale is edited, damaged or deleted."""
    controller = context.stand.machine.controller
    axis = controller.axes["xy"[context.axis]]
    assert axis.scale is not None
    path = context.rng.choice((controller.controller.eds, axis.drive.eds, axis.scale.eds))
    context.undo.append(clear_eds_cache)
    _change(context, path, "DataType=0x0007", "DataType=0x0005")
    clear_eds_cache()


def _change(context: FaultContext, path: Path, old: str, new: str) -> None:
    """Edit, truncate or delete a file, and wait until the daemon has checked it."""
    text = path.read_text(encoding="utf-8")
    assert old in text, old
    context.undo.append(lambda: path.write_text(text, encoding="utf-8"))
    context.stand.loop.threads_that_called_back.discard(WATCHER_THREAD)
    match context.rng.randrange(3):
        case 0:
            path.write_text(text.replace(old, new), encoding="utf-8")
        case 1:
            path.write_bytes(text.encode()[: len(text) // 2])
        case _:
            path.unlink()
    deadline_s = time.monotonic() + DETECTION_MAX_S
    while WATCHER_THREAD not in context.stand.loop.threads_that_called_back and time.monotonic() < deadline_s:
        time.sleep(0.002)


FAULTS = (
    Fault("machine file changed", machine_file_changed, None, ("was changed during the run",), states=WIRED),
    Fault("EDS changed", eds_changed, None, ("was changed during the run",), states=WIRED),
)
