"""Runs in a copy of the tree that has the load compensation; see docs/development.md."""

import math
from pathlib import Path

import pytest
from law_records import axis_records
from numpy.testing import assert_allclose

from kernels.records import read
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.key_tables import filled
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.axis_record import tick_axis
from servo_ctrl.control.compensation import load_compensation
from servo_ctrl.control.types import AxisCommand, AxisSample
from servo_ctrl.errors import ConfigError

ROOT = Path.cwd()
TABLE = ROOT / "machines" / "xy_table"
AT_REST = AxisSample(
    position_command_m=0.0,
    velocity_command_m_s=0.0,
    acceleration_command_m_s2=0.0,
    force_offset_n=0.0,
    motor_position_m=0.0,
    scale_position_m=0.0,
    motor_force_n=math.nan,
)


def machine(folder: Path, section: str) -> Path:
    text = (TABLE / "controller.toml").read_text(encoding="utf-8")
    (folder / "controller.toml").write_text(
        f"{text}\n[axis.x.load_compensation]\n{section}", encoding="utf-8"
    )
    return folder / "controller.toml"


def force_n(file: Path) -> float:
    axes, tables = axis_records([axis_params(load_machine(file), "x")], [0.0])
    axes["sample"] = AT_REST
    tick_axis(axes[0], tables)
    return read(axes["command"], AxisCommand).force_n


def test_the_force_of_the_file_is_held(tmp_path: Path) -> None:
    assert_allclose(force_n(machine(tmp_path, "weight_kg = 4.0\n")), 4.0 * load_compensation.GRAVITY_M_S2)


def test_switched_off_it_changes_nothing(tmp_path: Path) -> None:
    assert force_n(machine(tmp_path, "weight_kg = 4.0\nenabled = false\n")) == 0.0
    assert force_n(TABLE / "controller.toml") == 0.0


def test_the_file_is_checked(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"load_compensation\.weight_kg: .*greater than or equal to 0"):
        load_machine(machine(tmp_path, "weight_kg = -1.0\n"))
    with pytest.raises(ConfigError, match=r"axis\.x\.load_compensation\.mass_kg: unknown key"):
        load_machine(machine(tmp_path, "weight_kg = 1.0\nmass_kg = 2.0\n"))


def test_the_document_has_its_keys() -> None:
    document = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    assert "`weight_kg`" in document
    assert filled(document) == document
