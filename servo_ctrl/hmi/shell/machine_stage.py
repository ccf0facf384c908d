"""The stages of the machine as the pages show them."""

from typing import Literal, NamedTuple

from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage

Tone = Literal["calm", "good", "warn", "bad"]
"""How much attention a state needs; a CSS class of a pill."""


class ShownStage(NamedTuple):
    """A sign, a word and a tone."""

    sign: str
    word: str
    tone: Tone


_SHOWN: dict[Stage, ShownStage] = {
    Stage.BOOTING: ShownStage("\u2026", "Booting", "calm"),
    Stage.STARTING: ShownStage("\u2026", "Switching on", "warn"),
    Stage.READY: ShownStage("\u25cf", "Ready", "good"),
    Stage.RUNNING: ShownStage("\u25b6", "Running", "good"),
    Stage.STOPPING: ShownStage("\u25bc", "Stopping", "warn"),
    Stage.QUICK_STOPPING: ShownStage("\u25bc", "Quick stop", "bad"),
    Stage.DISABLING: ShownStage("\u25bc", "Switching off", "warn"),
    Stage.OFF: ShownStage("\u25cb", "Ended", "calm"),
    Stage.STANDBY: ShownStage("\u25cb", "Standby", "calm"),
}
_FAULTED = ShownStage("\u2716", "Fault", "bad")
_REQUESTED = ("switched off by ", "quick stop by ", "stopped by ")
"""How the reason of a stop begins that somebody has asked for."""


def shown_stage(status: MachineStatus | None) -> ShownStage:
    """The stage to show; None: the controller has sent no status yet."""
    if status is None:
        return ShownStage("\u2026", "No contact", "bad")
    if status.stage is Stage.STANDBY and is_fault(status.reason):
        return _FAULTED
    return _SHOWN[status.stage]


def is_fault(reason: str) -> bool:
    """Whether the machine stopped by itself, or a requested stop went wrong on the way."""
    return any(part and not part.startswith(_REQUESTED) for part in reason.split("; "))
