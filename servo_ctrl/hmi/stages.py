"""The machine's stages as the page shows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from servo_ctrl.config.local_status import Stage, Status


class ShownStage(NamedTuple):
    """A sign and a word, and how much it wants attention."""

    sign: str
    word: str
    tone: Literal["calm", "good", "warn", "bad"]


_SHOWN: dict[Stage, ShownStage] = {
    "booting": ShownStage("\u2026", "Booting", "calm"),
    "starting": ShownStage("\u2026", "Switching on", "warn"),
    "ready": ShownStage("\u25cf", "Ready", "good"),
    "running": ShownStage("\u25b6", "Running", "good"),
    "stopping": ShownStage("\u25bc", "Stopping", "warn"),
    "quick_stopping": ShownStage("\u25bc", "Quick stop", "bad"),
    "disabling": ShownStage("\u25bc", "Switching off", "warn"),
    "off": ShownStage("\u25cb", "Ended", "calm"),
    "standby": ShownStage("\u25cb", "Standby", "calm"),
}
_FAULTED = ShownStage("\u2716", "Fault", "bad")
_WISHES = ("switched off by ", "quick stop by ", "stopped by ")
"""How reasons begin that somebody has wanted."""


def shown_stage(status: Status | None) -> ShownStage:
    """Where the machine is."""
    if status is None:
        return ShownStage("\u2026", "No contact", "bad")
    if status.stage == "standby" and is_fault(status.reason):
        return _FAULTED
    return _SHOWN[status.stage]


def is_fault(reason: str) -> bool:
    """The machine stopped by itself, or what somebody asked for went wrong on the way."""
    return any(part and not part.startswith(_WISHES) for part in reason.split("; "))
