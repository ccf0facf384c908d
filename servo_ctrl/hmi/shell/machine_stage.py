"""The stages of the machine as the pages show them."""

from typing import Literal, NamedTuple

from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.languages.texts import word

Tone = Literal["calm", "good", "warn", "bad"]
"""How much attention a state needs; a CSS class of a pill."""


class ShownStage(NamedTuple):
    """A sign, a word and a tone."""

    sign: str
    word: str
    tone: Tone


_SHOWN: dict[Stage, ShownStage] = {
    Stage.BOOTING: ShownStage("\u2026", word("Booting"), "calm"),
    Stage.STARTING: ShownStage("\u2026", word("Switching on"), "warn"),
    Stage.READY: ShownStage("\u25cf", word("Ready"), "good"),
    Stage.RUNNING: ShownStage("\u25b6", word("Running"), "good"),
    Stage.STOPPING: ShownStage("\u25bc", word("Stopping"), "warn"),
    Stage.QUICK_STOPPING: ShownStage("\u25bc", word("Quick stop"), "bad"),
    Stage.DISABLING: ShownStage("\u25bc", word("Switching off"), "warn"),
    Stage.OFF: ShownStage("\u25cb", word("Ended"), "calm"),
    Stage.STANDBY: ShownStage("\u25cb", word("Standby"), "calm"),
}
_FAULTED = ShownStage("\u2716", word("Fault"), "bad")
_SETTING_UP = ShownStage("\u2026", word("Setting up nodes"), "warn")
_HELD = ShownStage("\u275a\u275a", word("Held"), "warn")
_JOGGING = ShownStage("\u2194", word("Jogging"), "good")
_HOMING = ShownStage("\u2302", word("Homing"), "warn")
_LEARNING: dict[LearningState, ShownStage] = {
    LearningState.RUNNING: ShownStage("\u21bb", word("Learning"), "good"),
    LearningState.PAUSING: ShownStage("\u275a\u275a", word("Learning pauses"), "warn"),
    LearningState.PAUSED: ShownStage("\u275a\u275a", word("Learning paused"), "warn"),
}
_REQUESTED = ("switched off by ", "quick stop by ", "stopped by ")
"""How the reason of a stop begins that somebody has asked for."""


def shown_stage(status: MachineStatus | None, *, jogged: bool = False) -> ShownStage:
    """Return the stage to show; None: there was no status yet. `jogged`: axes move, but in no step."""
    if status is None:
        return ShownStage("\u2026", word("No connection"), "bad")
    if status.setting_up:
        return _SETTING_UP
    if status.stage is Stage.STANDBY and is_fault(status.reason):
        return _FAULTED
    if status.stage is Stage.STARTING and any(drive.phase == "homing" for drive in status.drives):
        return _HOMING
    if status.stage in {Stage.READY, Stage.RUNNING}:
        return _shown_work(status, jogged)
    return _SHOWN[status.stage]


def _shown_work(status: MachineStatus, jogged: bool) -> ShownStage:
    """Return the activity of a machine that is ready or runs."""
    if status.learning.state in _LEARNING:
        return _LEARNING[status.learning.state]
    if status.stage is Stage.RUNNING and status.program.held:
        return _HELD
    if status.stage is Stage.RUNNING and status.program.step < 0 and jogged:
        return _JOGGING
    return _SHOWN[status.stage]


def is_fault(reason: str) -> bool:
    """Whether the machine stopped by itself, or a requested stop went wrong on the way."""
    return any(part and not part.startswith(_REQUESTED) for part in reason.split("; "))
