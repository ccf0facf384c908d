"""What cannot be tuned is refused before anything moves, with the reason and what to do."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from servo_ctrl.cli.main import app
from servo_ctrl.config.load import load_machine
from servo_ctrl.tuning.request import TuneRequest


def request(machines: Path, file: str, axis: str) -> TuneRequest:
    machine = load_machine(machines / file)
    return TuneRequest(machine, axis, Path("out"), 2.0, None, lambda _progress: None, lambda _text: None)


@pytest.mark.parametrize(
    ("file", "words"),
    [
        (
            "fuzzy_table/controller_pid.toml",
            ("mode csv", "kv_n_s_m and ki_n_m", "kp_1_s by hand", "mode cst"),
        ),
        ("precision_stage/controller.toml", ("mode csp", "no gain of the machine file", "mode cst")),
    ],
)
def test_loops_that_the_drive_closes_are_left_to_it(
    machines: Path, file: str, words: tuple[str, ...]
) -> None:
    axis = next(iter(load_machine(machines / file).axes))
    objection = request(machines, file, axis).objection()
    assert objection.startswith(f"axis {axis}: ")
    assert [word for word in words if word not in objection] == []


def test_an_axis_in_mode_cst_has_no_objection(machines: Path) -> None:
    assert request(machines, "xy_table/controller.toml", "x").objection() == ""
    assert "has no axis w, only x, y" in request(machines, "xy_table/controller.toml", "w").objection()


def test_the_command_ends_before_anything_moves(machines: Path, tmp_path: Path) -> None:
    # nothing is at the end of this bus
    arguments = [
        "tune",
        "--machine",
        str(machines / "precision_stage"),
        "--axis",
        "x",
        "--bus",
        "localcan:none",
    ]
    result = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert "mode csp" in str(result.exception) or "mode csp" in result.output
    assert not (tmp_path / "out").exists()
