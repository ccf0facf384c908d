"""Faults of files that the run was made from: changed, damaged or gone under way."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tests.campaigns.campaign.fault_context import WIRED, Fault
from tests.campaigns.campaign.machine import read_eds_anew

if TYPE_CHECKING:
    from pathlib import Path

    from tests.campaigns.campaign.fault_context import FaultContext

PATIENCE_S = 10.0
WATCHER = "changed files"


def machine_file_changed(context: FaultContext) -> None:
    """Somebody edits the machine file, damages it or takes it away."""
    _change(context, context.stand.machine.controller.source, "kv_n_s_m = 14700.0", "kv_n_s_m = 14.0")


def eds_changed(context: FaultContext) -> None:
    """The same with an EDS: the controller's own, a drive's or a scale's."""
    controller = context.stand.machine.controller
    axis = controller.axes["xy"[context.axis]]
    assert axis.scale is not None
    path = context.rng.choice((controller.controller.eds, axis.drive.eds, axis.scale.eds))
    context.undo.append(read_eds_anew)
    _change(context, path, "DataType=0x0007", "DataType=0x0005")
    read_eds_anew()


def _change(context: FaultContext, path: Path, part: str, other: str) -> None:
    """Another part in it, or half of it, or none; the daemon's look is waited for."""
    text = path.read_text(encoding="utf-8")
    assert part in text, part
    context.undo.append(lambda: path.write_text(text, encoding="utf-8"))
    context.stand.loop.posted.discard(WATCHER)
    match context.rng.randrange(3):
        case 0:
            path.write_text(text.replace(part, other), encoding="utf-8")
        case 1:
            path.write_bytes(text.encode()[: len(text) // 2])
        case _:
            path.unlink()
    deadline_s = time.monotonic() + PATIENCE_S
    while WATCHER not in context.stand.loop.posted and time.monotonic() < deadline_s:
        time.sleep(0.002)


FAULTS = (
    Fault("machine file changed", machine_file_changed, None, ("was changed under way",), states=WIRED),
    Fault("EDS changed", eds_changed, None, ("was changed under way",), states=WIRED),
)
