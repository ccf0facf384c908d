"""The program of a run: checked offline from home, and again from where the axes really are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.config.freeze import motion_limits
from servo_ctrl.config.program import check_program, check_steps
from servo_ctrl.daemon.reference import CHUNK_SAMPLES, ProgramReference
from servo_ctrl.motion.program import segments

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig
    from servo_ctrl.motion.program import Step


class MotionPlan:
    """A program on a machine; without a program the axes are held. Raises ConfigError (limits, files)."""

    def __init__(self, machine: MachineConfig, program: ProgramConfig | None) -> None:
        self._machine = machine
        self._program = program
        self.steps: Sequence[Step] = check_program(program, machine) if program is not None else ()
        self.cycles = 0
        """How long the program takes, known once it is prepared."""

    @property
    def empty(self) -> bool:
        """There is nothing to run."""
        return self._program is None

    def prepare(self, start_m: Sequence[float]) -> ProgramReference:
        """The rows from `start_m`, metres per axis; raises ConfigError when that leaves the limits."""
        if self._program is not None:
            self.cycles = check_steps(self.steps, self._program.source, self._machine, start_m)
        start, limits = np.asarray(start_m, dtype=np.float64), motion_limits(self._machine)
        return ProgramReference(segments(self.steps, start, limits, self._machine.period_s, CHUNK_SAMPLES))
