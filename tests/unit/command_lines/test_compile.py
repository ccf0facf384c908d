"""The hidden subcommand `compile`: kernels before the first start."""

from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from hil_sim.cli.main import app as hil_sim
from hil_sim.plant.integrate import advance
from kernels.jit import signatures
from servo_ctrl.cli.main import app as servo_ctrl
from servo_ctrl.cyclic.axis_step import step_axes
from servo_ctrl.motion.path.distance import nearest
from servo_ctrl.motion.path.zones import speed_and_acceleration

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
BOTH = pytest.mark.parametrize(("program", "kernel"), [(servo_ctrl, step_axes), (hil_sim, advance)])
NEEDED = [
    (servo_ctrl, step_axes),
    (servo_ctrl, speed_and_acceleration),
    (servo_ctrl, nearest),
    (hil_sim, advance),
]


@pytest.mark.parametrize(("program", "kernel"), NEEDED)
def test_kernels_are_compiled(program: typer.Typer, kernel: Callable[..., None]) -> None:
    done = CliRunner().invoke(program, ["compile", "--machine", str(MACHINE)])
    assert (done.exit_code, done.output) == (0, "")
    assert signatures(kernel) >= 1


@BOTH
def test_compile_is_hidden_from_the_command_list(program: typer.Typer, kernel: Callable[..., None]) -> None:
    assert kernel.__name__
    assert "compile" not in CliRunner().invoke(program, ["--help"]).output


def test_a_missing_plant_is_a_one_line_error(tmp_path: Path) -> None:
    done = CliRunner().invoke(hil_sim, ["compile", "--machine", str(tmp_path / "none")])
    assert (done.exit_code, done.output.count("\n")) == (1, 1)
