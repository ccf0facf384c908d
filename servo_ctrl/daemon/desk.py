"""The daemon's answer to whoever asks: over SDO, MQTT and the command line alike; see `config.desk`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.config.desk import (
    AxisStatus,
    DeskStatus,
    LearningState,
    LearningStatus,
    Refusal,
    Request,
    Setting,
    Verdict,
)

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.daemon.assembly import Assembly


class ControllerDesk:
    """There from the start; before the machine is assembled it says so."""

    def __init__(self, config: MachineConfig) -> None:
        self._config = config
        self._assembly: Assembly | None = None

    def attach(self, assembly: Assembly) -> None:
        """The machine is there."""
        self._assembly = assembly

    def execute(self, request: Request) -> Verdict:
        """Carry out a command, or say why not."""
        return Verdict(Refusal.WRONG_STATE, f"{request.command.name}: not now")

    def change(self, setting: Setting, value: float) -> Verdict:
        """Change a setting, or say why not."""
        return Verdict(Refusal.WRONG_STATE, f"{setting.name} = {value:g}: not now")

    def status(self) -> DeskStatus:
        """What there is to know now."""
        stage, cycles, missed = Stage.BOOTING, 0, 0
        if self._assembly is not None:
            machine, cycle = self._assembly
            stage, cycles, missed = machine.stage, cycle.number + 1, machine.missed_ticks
        axes = tuple(
            AxisStatus(name, False, False, False, 0, None, 0, "", None) for name in self._config.axes
        )
        learning = LearningStatus(LearningState.IDLE, "", None, "")
        settings = {
            Setting.REQUIRED_M: self._config.monitoring.required_um * 1e-6,
            Setting.LEARNER: float(self._config.learning.learner == "paper"),
            Setting.ADAPTATION: float(self._config.learning.adaptation),
        }
        return DeskStatus(stage, cycles, missed, learning, axes, settings)
