"""The status says which axes contour control couples, and their contour error while they are led."""

import math
from pathlib import Path

import pytest
from machine_files import XY_TABLE, text_of, write_controller

from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.missing_inputs import Tolerance
from servo_ctrl.daemon.run.assemble import build_axes

SECTION = '\n[contour_control]\naxes = ["y", "x"]\nkp_1_s = 50.0\n'
CIRCLE = [2e-3, 0.01, 0.0, 0.0, 3e-3, 0.0, 0.0, 0.0]


def machine(directory: Path, section: str = "") -> tuple[MachineController, list[bytes]]:
    """The X-Y table, whose nodes stand at zero; the TPDOs of its drives and scales."""
    text = text_of(XY_TABLE / "controller.toml") + section
    config = load_machine(write_controller(directory, text))
    plans = plan_machine(config)
    made = MachineController(
        build_axes(config, plans), [plan.name for plan in plans], 1e-3, Tolerance(5, 300)
    )
    return made, [bytes(plan.tpdo.codec.size) for plan in plans]


def test_without_the_section_no_axes_are_named(tmp_path: Path) -> None:
    made, _ = machine(tmp_path)
    assert made.contour.axes == ()
    assert math.isnan(made.contour.error_m)


def test_with_it_the_axes_are_named_in_its_order_and_the_error_is_that_of_the_last_cycle(
    tmp_path: Path,
) -> None:
    made, inputs = machine(tmp_path, SECTION)
    assert made.contour.axes == ("y", "x")
    assert math.isnan(made.contour.error_m)
    memory = made._drives._memory
    memory.axes["engaged"], memory.axes["inputs"]["scale_offset_m"] = True, 0.0
    memory.step(inputs, CIRCLE, 0.0, 0, 0)
    # x moves; with y as the first of the pair, the left of the path is -y
    assert made.contour.error_m == pytest.approx(-3e-3)
