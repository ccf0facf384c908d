"""The precision stage with a short travel, and its services on a fake machine."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from learning_stand import LearningStand
from machine_files import REPOSITORY, text_of, write_controller

from servo_ctrl.control.tick import AxisParams
from servo_ctrl.recording.channels import AxisRow

STAGE = REPOSITORY / "machines" / "precision_stage"
LEAD_M, LOST_M = 5e-3, 6e-6
SECTION = """[axis.x.screw_compensation]
travels = 2
feed_mm_min = 1200.0
dwell_s = 0.05
limit_um = 100.0

"""
TRAVELS = 3
"""Travels of a learning run: two and the check."""


def stage_file(directory: Path, *changes: tuple[str, str]) -> Path:
    """Return the machine file with 12 mm of travel and texts replaced (old, new)."""
    text = text_of(STAGE / "controller.toml")
    text = re.sub(r"position_mm = \[.*?\]", "position_mm = [-6.0, 6.0]", text)
    text = re.sub(r"\[axis\.x\.screw_compensation\]\n(?:[^\[\n].*\n|\n)*", "", text) + "\n" + SECTION
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return write_controller(directory, text)


def screw_error_m(motor_m: float) -> float:
    """Return the error of a screw with a lead that is too long and a periodic error."""
    return 1e-4 * motor_m + 2e-6 * math.sin(2.0 * math.pi * motor_m / LEAD_M)


class ScrewStand(LearningStand):
    """The motor follows its set point; the table follows the motor with the screw's error and lost motion."""

    def __init__(self, machine_file: Path, learned: Path, **options: Any) -> None:
        super().__init__(machine_file, learned, **options)
        self.error = screw_error_m
        self._direction = -1.0

    @property
    def params(self) -> AxisParams:
        """The parameters of the control law."""
        return self.servos["x"].params

    def _take(self, row: list[float], step: int) -> None:
        position_m, velocity_m_s = row[:2]
        self._direction = math.copysign(1.0, velocity_m_s) if velocity_m_s else self._direction
        screw, take_up = self.params.screw, self.params.take_up
        correction_m = 0.0
        if screw.enabled:
            correction_m = 0.5 * take_up.lost_motion_m * self._direction - float(
                np.interp(position_m, *screw.table)
            )
        motor_m = position_m + correction_m
        scale_m = motor_m + self.error(motor_m) - 0.5 * LOST_M * self._direction
        axis = AxisRow._make([0.0] * len(AxisRow._fields))._replace(
            position_command_m=position_m,
            velocity_command_m_s=velocity_m_s,
            motor_position_m=motor_m,
            scale_position_m=scale_m,
            correction_m=correction_m,
        )
        self.machine.at_m[0] = position_m
        self.services.rows.take([self.cycle * 1e-3, self.cycle, step, *axis])
