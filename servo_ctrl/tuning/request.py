"""What is to be tuned, and why that may be impossible."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation.disturbance_observer import DisturbanceObserverSettings
from servo_ctrl.control.compensation.fuzzy_pd import FuzzyPdSettings
from servo_ctrl.daemon.run.report import Progress

CLOSED_IN_THE_DRIVE = {
    "csv": "the drive closes the velocity loop with gains of its own, so that kv_n_s_m and ki_n_m, which "
    "tune sets, have no effect, and the force that it commands, without which plant and loop cannot be told "
    "apart, stays in the drive. Tune that loop there and kp_1_s by hand, or tune in mode cst",
    "csp": "the drive closes position and velocity loop with gains of its own, and no gain of the machine "
    "file acts. Tune both loops in the drive, or tune in mode cst",
}
"""Why there is nothing to propose, and what to do, by mode."""
NOT_PROVED = "the proposal was not proved; nothing was applied"
STEPS = 6
"""Usual calls of `report_stage` on the simulator: the first gains and the first proposal are good enough."""


class TuneRequest(NamedTuple):
    """What is to be tuned, and who is kept informed."""

    machine: MachineConfig
    axis: str
    out: Path
    """Folder of recordings and excitation samples."""
    ms: float
    """Largest sensitivity peak of the proposal."""
    force_n: float | None
    """Peak of the excitation; None: derived from the reaction to a weak one."""
    show: Callable[[Progress], None]
    """Called with the progress of each run."""
    report_stage: Callable[[str], None]
    """Called with a line about each stage."""

    def objection(self) -> str:
        """Say why this axis cannot be tuned, or return ""."""
        if self.axis not in self.machine.axes:
            return f"{self.machine.machine.name} has no axis {self.axis}, only {', '.join(self.machine.axes)}"
        config = self.machine.axes[self.axis]
        if config.mode != "cst":
            return f"axis {self.axis}: mode {config.mode}: {CLOSED_IN_THE_DRIVE[config.mode]}"
        for kind in (FuzzyPdSettings, DisturbanceObserverSettings):
            if config.acts(kind):
                name = kind.__name__.removesuffix("Settings")
                return f"axis {self.axis}: {name} acts; switch it off while you tune"
        return ""
