"""A machine file to spoil, and the machines of the project."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig

MACHINES = Path(__file__).parents[3] / "machines"
ROUND_VALUES = {"kp_1_s": "40.0", "kv_n_s_m": "20000.0", "window_s": "0.2"}
"""Stand for what calibration changes now and then."""


@pytest.fixture
def machines() -> Path:
    return MACHINES


@pytest.fixture
def table() -> MachineConfig:
    return load_machine(MACHINES / "xy_table")


@pytest.fixture
def spoilt(tmp_path: Path) -> Callable[[str, str], Path]:
    """The X-Y table's machine file with the first occurrence of a text replaced by another."""

    def make(text: str, replacement: str) -> Path:
        original = (MACHINES / "xy_table" / "controller.toml").read_text(encoding="utf-8")
        for key, value in ROUND_VALUES.items():
            original = re.sub(rf"^{key} = .*$", f"{key} = {value}", original, flags=re.MULTILINE)
        assert text in original
        path = tmp_path / "controller.toml"
        path.write_text(original.replace(text, replacement, 1), encoding="utf-8")
        return path

    return make


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    """A program file of this text."""

    def make(text: str) -> Path:
        path = tmp_path / "program.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return make
