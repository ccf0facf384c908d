"""A machine file whose learning has few short strokes, and operated machines."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ideal_drives import ROUND, Operate, OperatedStand, ideal_machine_file
from learning_stand import LearningStand, short_learning
from machine_files import XY_TABLE, text_of, write_controller
from operated_programs import load

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program_model import ProgramConfig

SHORT_STROKES = {
    "radius_mm = 50.0": "radius_mm = 2.0",
    "[2.0, 8.0, 30.0, 120.0]": "[400.0, 500.0, 600.0, 700.0]",
    "jerk_mm_s3 = 50000.0": "jerk_mm_s3 = 500000.0",
}


@pytest.fixture
def machine_file(tmp_path: Path) -> Path:
    return write_controller(tmp_path, text_of(XY_TABLE / "controller.toml", SHORT_STROKES))


@pytest.fixture
def stand(
    machine_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., LearningStand]:
    """Machines that learn."""
    short_learning(monkeypatch)
    return lambda **options: LearningStand(machine_file, tmp_path / "learned", **options)


@pytest.fixture
def operated(tmp_path: Path) -> Operate:
    """Machines that stand by."""

    def made(*, homing_method: int = 0, **options: Any) -> OperatedStand:
        path = ideal_machine_file(tmp_path, homing_method=homing_method)
        return OperatedStand(path, tmp_path / "learned", **options)

    return made


@pytest.fixture
def enabled(operated: Operate) -> Operate:
    """Machines that are ready."""

    def made(**options: Any) -> OperatedStand:
        stand = operated(**options)
        stand.run(3)
        assert stand.ask(Command.ENABLE).accepted
        stand.run(100)
        assert stand.machine.stage is Stage.READY
        return stand

    return made


@pytest.fixture
def loaded(enabled: Operate, tmp_path: Path) -> OperatedStand:
    """A machine that is ready, with the program of `operated_programs`."""
    made = enabled()
    load(made, tmp_path)
    return made


@pytest.fixture
def round_program(tmp_path: Path) -> ProgramConfig:
    """A circle and a rest."""
    path = tmp_path / "round.toml"
    path.write_text(ROUND, encoding="utf-8")
    return load_program(path, load_machine(ideal_machine_file(tmp_path)))
