"""The contour error of synthetic recordings with a known distance from the path."""

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from kernels.arrays import Array
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.part_program_reader import read_part_program
from servo_ctrl.config.program import program_segments
from servo_ctrl.metrology.contour_error import contour_error, distance_to_path, write_contour_error
from servo_ctrl.motion.program import Step
from servo_ctrl.recording.reader import Recording

UM = 1e-6
PERIOD_S = 1e-3


@pytest.fixture(scope="module")
def table() -> MachineConfig:
    return load_machine(Path(__file__).parents[3] / "machines" / "xy_table")


def recorded(
    table: MachineConfig, folder: Path, text: str, moved: Callable[[Array], Array]
) -> tuple[Recording, list[Step]]:
    """A run of a program whose table is where `moved` puts the command (n, axes)."""
    path = folder / "part.ngc"
    path.write_text(text, encoding="utf-8")
    steps = list(read_part_program(path, ["x", "y"]).motion)
    parts = list(program_segments(steps, table, [0.0, 0.0]))
    command_m = np.concatenate([np.zeros((5, 2)), *(part.position_m for part in parts)])
    step = np.concatenate([np.full(5, -1), *(np.full(len(part.position_m), part.step) for part in parts)])
    scale_m = moved(command_m)
    columns: dict[str, Array] = {"segment": step, "cycle": np.arange(len(step))}
    for index, axis in enumerate(("x", "y")):
        columns[f"{axis}.position_command_m"] = command_m[:, index]
        columns[f"{axis}.motor_position_m"] = command_m[:, index] + 1.0  # not to be looked at
        columns[f"{axis}.scale_position_m"] = scale_m[:, index]
    return Recording(folder, {"axes": ["x", "y"], "period_s": PERIOD_S, "segments": []}, columns), steps


def test_a_table_beside_a_line_is_off_by_its_distance(table: MachineConfig, tmp_path: Path) -> None:
    recording, steps = recorded(
        table, tmp_path, "G0 X0 Y0\nG1 X10 F2000\nM2", lambda command: command + np.array([0.0, 3 * UM])
    )
    found = contour_error(recording, steps, table)
    assert found is not None
    for figures in (found.to_program, found.to_command):
        assert figures[:3] == pytest.approx((3 * UM, 3 * UM, 3 * UM), rel=1e-6)
        assert figures.line == 2
    assert found.rounding.largest_m < 1e-12
    assert found.samples == int(np.sum(recording.columns["segment"] == 1))


def test_a_table_that_lags_along_the_path_has_no_contour_error(table: MachineConfig, tmp_path: Path) -> None:
    def late(command: Array) -> Array:
        return np.concatenate((np.repeat(command[:1], 20, axis=0), command[:-20]))

    recording, steps = recorded(table, tmp_path, "G0 X10 Y0\nG4 P.1\nG3 X-10 I-10 F2000\nM2", late)
    found = contour_error(recording, steps, table)
    assert found is not None
    assert found.to_program.largest_m < 1e-12
    assert found.to_command.largest_m < 1e-12


def test_a_circle_too_large_is_off_by_its_radius(table: MachineConfig, tmp_path: Path) -> None:
    recording, steps = recorded(
        table, tmp_path, "G0 X10 Y0\nG3 I-10 F2000\nM2", lambda command: command * 1.0004
    )
    found = contour_error(recording, steps, table)
    assert found is not None
    assert found.to_program[:3] == pytest.approx((4 * UM, 4 * UM, 4 * UM), rel=1e-4)
    assert found.to_command[:3] == pytest.approx((4 * UM, 4 * UM, 4 * UM), rel=1e-2)


def test_a_rounded_corner_is_an_error_against_the_program_alone(table: MachineConfig, tmp_path: Path) -> None:
    text = "G64 P.5\nG0 X0 Y0\nG1 X10 F3000\nY10\nM2"
    recording, steps = recorded(table, tmp_path, text, lambda command: command)
    found = contour_error(recording, steps, table)
    assert found is not None
    x, y = (recording.columns[f"{axis}.position_command_m"] for axis in ("x", "y"))
    # the corner at (10, 0): inside of it the distance is that to the nearer of the two lines
    off_m = np.minimum(np.abs(y), np.abs(x - 10e-3))[recording.columns["segment"] == 1]
    assert found.rounding.largest_m == pytest.approx(off_m.max(), abs=1e-12)
    assert 50 * UM < found.rounding.largest_m <= 500 * UM
    assert found.to_program == found.rounding
    assert found.to_program.line in {3, 4}
    assert found.to_command.largest_m == 0.0


def test_rapid_moves_and_the_approach_count_for_nothing(table: MachineConfig, tmp_path: Path) -> None:
    def off(command: Array) -> Array:
        return command + np.array([0.0, 1e-3]) * (command[:, :1] < 5e-3)

    recording, steps = recorded(table, tmp_path, "G0 X1 Y0\nG0 X10\nG9 G1 X20 F3000\nG0 X0\nM2", off)
    found = contour_error(recording, steps, table)
    assert found is not None
    assert found.to_program.largest_m < 1e-12
    none, steps = recorded(table, tmp_path, "G0 X1 Y0\nG0 X10\nM2", off)
    assert contour_error(none, steps, table) is None


def test_the_line_of_the_largest_error_is_named_and_written(table: MachineConfig, tmp_path: Path) -> None:
    def bump(command: Array) -> Array:
        there = np.exp(-(((command[:, 0] - 0.01) / 1e-3) ** 2) - ((command[:, 1] - 0.005) / 1e-3) ** 2)
        return command + there[:, np.newaxis] * np.array([7 * UM, 0.0])

    text = "G0 X0 Y0\nG1 X10 F2000\nY10\nX0\nY0\nM2"
    recording, steps = recorded(table, tmp_path, text, bump)
    found = contour_error(recording, steps, table)
    assert found is not None
    assert found.to_command.line == 3
    write_contour_error(recording, found)
    written = json.loads((tmp_path / "contour_error.json").read_text(encoding="utf-8"))
    assert written["to_command"]["line"] == 3
    assert written["to_command"]["max_um"] == pytest.approx(7.0, rel=1e-3)
    assert written["samples_at_feed"] == found.samples


def test_the_distance_to_a_polyline_is_that_of_brute_force() -> None:
    rng = np.random.default_rng(2)
    path = np.cumsum(rng.normal(size=(60, 3)), axis=0)
    points = path + rng.normal(scale=0.4, size=path.shape)
    pieces = [a + np.linspace(0.0, 1.0, 2001)[:, np.newaxis] * (b - a) for a, b in pairwise(path)]
    for window in (100, 2):
        found = distance_to_path(points, path, window)
        for index, point in enumerate(points):
            near = np.concatenate(pieces[max(index - window, 0) : index + window + 1])
            assert found[index] == pytest.approx(np.linalg.norm(near - point, axis=1).min(), abs=2e-3)
