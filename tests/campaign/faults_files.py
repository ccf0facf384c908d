"""Faults of files that the run was made from: changed, damaged or gone under way."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from tests.campaign.faults_bus import WIRED
from tests.campaign.scene import Fault

if TYPE_CHECKING:
    from tests.campaign.scene import Scene

PATIENCE_S = 10.0
WATCHER = "changed files"


def machine_file_changed(scene: Scene) -> None:
    """Somebody edits the machine file, damages it or takes it away; the daemon's look is waited for."""
    path = scene.stand.machine.controller.source
    text = path.read_text(encoding="utf-8")
    scene.undo.append(lambda: path.write_text(text, encoding="utf-8"))
    scene.stand.loop.posted.discard(WATCHER)
    match scene.rng.randrange(3):
        case 0:
            path.write_text(text.replace("kv_n_s_m = 14700.0", "kv_n_s_m = 14.0"), encoding="utf-8")
        case 1:
            path.write_bytes(text.encode()[: len(text) // 2])
        case _:
            path.unlink()
    deadline_s = time.monotonic() + PATIENCE_S
    while WATCHER not in scene.stand.loop.posted and time.monotonic() < deadline_s:
        time.sleep(0.002)


FAULTS = (
    Fault("machine file changed", machine_file_changed, None, ("was changed under way",), states=WIRED),
)
