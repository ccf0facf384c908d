"""Axes of the X-Y table, in any mode, as `AxisServo`s."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.canopen.plan import NodePlan, plan_machine
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture
def machine_with(tmp_path: Path) -> Callable[..., MachineConfig]:
    """The X-Y table without some sections of its axes, other texts of its file replaced wherever they are."""

    def make(*without: str, **replacements: str) -> MachineConfig:
        text = (REPOSITORY / "machines" / "xy_table" / "controller.toml").read_text(encoding="utf-8")
        text = text.replace("../../eds", str(REPOSITORY / "eds"))
        for section in without:
            text = re.sub(rf"^\[axis\.\w+\.{section}\]\n(?:[^\[\n].*\n)*", "", text, flags=re.MULTILINE)
        for old, new in {"homing_method = 37": "homing_method = 0", **replacements}.items():
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "controller.toml"
        path.write_text(text, encoding="utf-8")
        return load_machine(path)

    return make


@pytest.fixture
def servo_of() -> Callable[[MachineConfig], tuple[AxisServo, NodePlan]]:
    """Axis x of a machine, and the plan of its drive."""

    def make(machine: MachineConfig) -> tuple[AxisServo, NodePlan]:
        drive, scale = plan_machine(machine)[:2]
        servo = AxisServo(
            "x",
            machine.axes["x"],
            axis_params(machine, "x"),
            rpdo=drive.rpdo.codec,
            tpdo=drive.tpdo.codec,
            scale_tpdo=scale.tpdo.codec,
        )
        return servo, drive

    return make


@pytest.fixture
def cst(machine_with: Callable[..., Any], servo_of: Callable[..., Any]) -> tuple[AxisServo, Any]:
    servo, plan = servo_of(machine_with())
    return servo, plan.rpdo.codec
