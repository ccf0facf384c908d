"""Axes of the X-Y table, in any mode, as `SteppedAxis`es."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from machine_files import XY_TABLE, text_of, without_sections, write_controller
from settled_axis import SteppedAxis

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture
def machine_with(tmp_path: Path) -> Callable[..., MachineConfig]:
    """The X-Y table without some sections of its axes, other texts of its file replaced."""

    def make(*without: str, **replacements: str) -> MachineConfig:
        changes = {"homing_method = 37": "homing_method = 0", **replacements}
        text = without_sections(text_of(XY_TABLE / "controller.toml", changes), *without)
        return load_machine(write_controller(tmp_path, text))

    return make


@pytest.fixture
def servo_of() -> Callable[[MachineConfig], tuple[SteppedAxis, NodePlan]]:
    """Axis x of a machine, and the plan of its drive."""

    def make(machine: MachineConfig) -> tuple[SteppedAxis, NodePlan]:
        drive, scale = plan_machine(machine)[:2]
        return SteppedAxis(machine, drive, scale), drive

    return make


@pytest.fixture
def cst(machine_with: Callable[..., Any], servo_of: Callable[..., Any]) -> tuple[SteppedAxis, Any]:
    servo, plan = servo_of(machine_with())
    return servo, plan.rpdo.codec
