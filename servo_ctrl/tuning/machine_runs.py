"""The runs of a tuning: each boots the drives, executes one program, stops in order and leaves a recording.

An axis whose homing method takes the present position for home has another home in each run. `MachineRuns`
keeps count of how far home has moved, shifts the limits accordingly, and ends each program where it began.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.run.report import Pacing, Progress
from servo_ctrl.daemon.run.stop_signals import exit_status_after
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.excitation.tuning_motion import TuningMotion, motion_steps
from servo_ctrl.hil_rig.simulated_run import new_recording
from servo_ctrl.recording.reader import Recording, load_recording
from servo_ctrl.tuning.runs import RunFailedError
from servo_ctrl.units import MM

HOMING_AT_PRESENT_POSITION = (35, 37)
"""Homing methods of CiA 402 that take the present position for home."""
NEVER_DUE_UM = 1e3
"""J_required that no reversal exceeds: a deviation of 1 mm ends a run as a following error; chosen."""


class TuneStoppedError(TuneError):
    """A signal ended the tuning; the axes were ramped down and the drives switched off."""

    def __init__(self, name: str) -> None:
        super().__init__(f"stopped by {name}; nothing was changed")
        self.exit_status = exit_status_after(name)


class MachineRuns:
    """Executes one program after the other on a bus; recordings go below `out`."""

    def __init__(
        self, machine: MachineConfig, bus: str, pacing: Pacing, out: Path, show: Callable[[Progress], None]
    ) -> None:
        self.bus = bus
        self._pacing, self._out, self._show = pacing, out, show
        self._home_m = {
            name: 0.0
            for name, config in machine.axes.items()
            if config.homing_method in HOMING_AT_PRESENT_POSITION
        }
        """Home of the next run in coordinates of the first run, of each axis that homes where it stands."""

    def in_present_coordinates(self, machine: MachineConfig) -> MachineConfig:
        """Return the machine with its position limits in the coordinates of the next run."""
        axes = dict(machine.axes)
        for name, home_m in self._home_m.items():
            limits = axes[name].limits
            shifted = [edge - home_m / MM for edge in limits.position_mm]
            limits = limits.model_copy(update={"position_mm": shifted})
            axes[name] = axes[name].model_copy(update={"limits": limits})
        return machine.model_copy(update={"axes": axes})

    async def record(self, machine: MachineConfig, motion: TuningMotion, name: str) -> Recording:
        """Execute the motion as a program and return its recording.

        Raises TuneStoppedError after a signal, RunFailedError where the run ended early.
        """
        directory = new_recording(self._out, name)
        steps = motion_steps(motion, machine, self._out / "excitation")
        steps = [*steps, *self._return_steps(machine, steps)]
        program = ProgramConfig.model_validate({"source": self._out / f"{name}.toml", "step": steps})
        report = await run_machine(
            _without_learning_rule(machine),
            program,
            self.bus,
            pacing=self._pacing,
            record_dir=directory,
            on_progress=self._show,
            compensation="off",
        )
        recording = load_recording(directory) if report.cycles else None
        if recording is not None:
            self._note_home(recording)
        if report.signal:
            raise TuneStoppedError(report.signal)
        if report.failed or not report.completed or recording is None:
            raise RunFailedError(f"the run ended early: {report.reason}")
        return recording

    def _return_steps(self, machine: MachineConfig, steps: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """A move to where the first run began, of the axes that move and home where they stand."""
        moved = {name for step in steps for name in (*step.get("to_mm", {}), *step.get("axes", ()))}
        homes = {name: -home_m / MM for name, home_m in self._home_m.items() if name in moved}
        if not homes:
            return []
        feed = 12.0 * min(machine.axes[name].limits.velocity_mm_s for name in homes)
        return [{"kind": "move", "label": "back", "to_mm": homes, "feed_mm_min": feed}]

    def _note_home(self, recording: Recording) -> None:
        """Note where the axes stand: the next run takes that position for home."""
        for name in self._home_m:
            position_m = recording.columns[f"{name}.motor_position_m"]
            known = position_m[np.isfinite(position_m)]
            if len(known):
                self._home_m[name] += float(known[-1])


def _without_learning_rule(machine: MachineConfig) -> MachineConfig:
    """Return the machine that never reports learning as due: nothing compensates in a run of a tuning."""
    monitoring = machine.monitoring.model_copy(update={"required_um": NEVER_DUE_UM})
    return machine.model_copy(update={"monitoring": monitoring})
