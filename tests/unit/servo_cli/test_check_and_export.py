"""`servo-ctrl check` and `servo-ctrl export` where all is well, and the help that teaches."""

import csv
from pathlib import Path

import pytest
from machine_files import text_of, write_controller
from typer.testing import CliRunner

from servo_ctrl.cli.main import app
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.recorder import Recorder, RecordingError

REPOSITORY = Path(__file__).parents[3]
XY_TABLE = REPOSITORY / "machines" / "xy_table"
RUNNER = CliRunner()


@pytest.mark.parametrize(
    "program", sorted((XY_TABLE / "programs").glob("*.toml")), ids=lambda path: path.stem
)
def test_programs_of_the_table_pass_the_check(program: Path) -> None:
    result = RUNNER.invoke(app, ["check", "--machine", str(XY_TABLE), "--program", str(program)])
    assert result.exit_code == 0
    assert "within limits" in result.output
    assert "axis.y.scale: position_value" in result.output


def test_strokes_of_learning_that_do_not_fit_fail_the_check(tmp_path: Path) -> None:
    too_large = {"radius_mm = 50.0": "radius_mm = 150.0"}
    write_controller(tmp_path, text_of(XY_TABLE / "controller.toml", too_large))
    result = RUNNER.invoke(app, ["check", "--machine", str(tmp_path)])
    assert isinstance(result.exception, ServoCtrlError)
    reason = str(result.exception)
    assert "controller.toml: learning: the stroke at 2 mm/s^2 is not possible" in reason
    assert "beyond the limit" in reason


def test_a_coupling_that_was_accepted_on_masses_is_noted_once(tmp_path: Path) -> None:
    section = '\n[contour_control]\naxes = ["x", "y"]\nkp_1_s = 20.0\n'
    write_controller(tmp_path, text_of(XY_TABLE / "controller.toml") + section)
    result = RUNNER.invoke(app, ["check", "--machine", str(tmp_path)])
    assert result.exit_code == 0
    assert result.output.count("accepted on their masses") == 1
    assert "servo-ctrl tune --axis NAME --apply" in result.output


def test_export_writes_every_column(tmp_path: Path) -> None:
    channels = channels_of(["x"])
    recorder = Recorder(tmp_path / "r", channels, {"axes": ["x"], "segments": []})
    recorder.record([float(place) for place in range(len(channels))])
    recorder.close({"axes": ["x"], "segments": []})
    result = RUNNER.invoke(app, ["export", str(tmp_path / "r"), "--csv", str(tmp_path / "out.csv")])
    assert result.exit_code == 0
    with (tmp_path / "out.csv").open(encoding="utf-8") as file:
        names, values = csv.reader(file)
    assert names == [channel.name for channel in channels]
    assert [float(value) for value in values] == list(range(len(channels)))


def test_export_to_a_place_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", channels_of(["x"]), {"axes": ["x"], "segments": []})
    recorder.record([0.0] * len(channels_of(["x"])))
    recorder.close({"axes": ["x"], "segments": []})
    result = RUNNER.invoke(app, ["export", str(tmp_path / "r"), "--csv", str(tmp_path / "no" / "out.csv")])
    assert isinstance(result.exception, RecordingError)
    assert "out.csv: cannot be written: No such file or directory" in str(result.exception)


@pytest.mark.parametrize("command", ["run", "check", "export"])
def test_help_shows_an_example(command: str) -> None:
    result = RUNNER.invoke(app, [command, "--help"], env={"COLUMNS": "200"})
    assert result.exit_code == 0
    assert f"servo-ctrl {command} " in result.output


def test_ill_formed_input_is_a_usage_error() -> None:
    result = RUNNER.invoke(app, ["check", "--machine", str(XY_TABLE), "--input", "train"])
    assert result.exit_code == 2
    assert "NAME=FILE" in result.output
