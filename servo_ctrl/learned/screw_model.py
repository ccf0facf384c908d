"""The schema of a learned screw, error table and lost motion, and the values that it depends on."""

from itertools import pairwise
from typing import Annotated

from pydantic import Field, field_validator

from servo_ctrl.config.learning import NODES_MAX
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.section import FileSection, NonNegative, Number
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.learned.file_model import Basis, LearnedContent
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.units import UM

SLOPE_MAX = 0.05
"""Bounds the slope of the error over the travel, m/m; chosen: a poor screw has 0.01, and at 1 the motor would
reverse."""


class ScrewPoint(FileSection):
    """One node of the table."""

    position_m: Number
    error_m: Number
    lost_motion_m: Number
    """Lost motion at this position; the control law uses the mean."""


class ScrewTable(LearnedContent):
    """`learning.screw.ScrewLearned` with the points by name."""

    result = ScrewLearned
    lost_motion_m: NonNegative
    spread_m: NonNegative
    points: Annotated[list[ScrewPoint], Field(min_length=2, max_length=NODES_MAX + 2)]

    @field_validator("points")
    @classmethod
    def _rising(cls, value: list[ScrewPoint]) -> list[ScrewPoint]:
        positions = [point.position_m for point in value]
        if sorted(set(positions)) != positions:
            raise ValueError("the positions must rise")
        return value

    @staticmethod
    def basis(machine: MachineConfig, axis: str) -> Basis:
        """Return the values that define the table's position: home, units of encoder and scale; no gains."""
        config = machine.axes[axis]
        basis: Basis = {
            "homing_method": config.homing_method,
            "transmission.lead_mm": config.transmission.lead_mm,
            "drive.counts_per_rev": config.drive.counts_per_rev,
        }
        if config.scale is not None:
            basis["scale.resolution_um"] = config.scale.resolution_um
        return basis

    def objection(self, machine: MachineConfig, axis: str) -> str:
        """Return why a correction exceeds limit_um or is steeper than a screw error can be, else ""."""
        config = machine.axes[axis].section(ScrewCompensationSettings)
        if config is None:
            return ""
        for point in self.points:
            correction_m = abs(point.error_m) + 0.5 * self.lost_motion_m
            if correction_m > config.limit_um * UM:
                return (
                    f"has a correction of {correction_m / UM:.6g} um at {point.position_m * 1e3:g} mm, "
                    f"beyond limit_um {config.limit_um:g} um"
                )
        for left, right in pairwise(self.points):
            slope = abs(right.error_m - left.error_m) / (right.position_m - left.position_m)
            if slope > SLOPE_MAX:
                return (
                    f"has an error that changes by {slope:.3g} of the travel at {left.position_m * 1e3:g} mm"
                    f", more than {SLOPE_MAX:g}"
                )
        return ""
