"""Part programs on the command line: dry run, plot, refusals."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
import typer
from run_report_example import REPORT
from typer.testing import CliRunner

from servo_ctrl.cli.conclusion import conclude
from servo_ctrl.cli.main import app
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.errors import ConfigError
from servo_ctrl.recording.recorder import RecordingError

REPOSITORY = Path(__file__).parents[3]
XY_TABLE = REPOSITORY / "machines" / "xy_table"
PROGRAMS = XY_TABLE / "programs"
CHECK = ["check", "--machine", str(XY_TABLE), "--program"]
RUNNER = CliRunner()


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "Part.NGC"
    path.write_text("G0 X0 Y0\n(a comment)\nG1 X20 F600 S100\nX20.1 F6000\n/Y20\nM2\n", encoding="utf-8")
    return path


def test_a_dry_run_lists_time_extents_limits_and_words_without_effect(part: Path) -> None:
    result = RUNNER.invoke(app, [*CHECK, str(part)])
    assert result.exit_code == 0
    assert "5 blocks, corners within 0.01 mm, exact stops: 1, G54 x 0, y 0 mm" in result.output
    assert re.search(r"Part\.NGC: 2 steps, \d\.\d\d s, within limits", result.output)
    assert "x: 0.000 to 20.100 mm (limits -100 to 100)" in result.output
    assert "y: 0.000 to 20.000 mm (limits -100 to 100)" in result.output
    assert "of 2000 mm/s^2" in result.output
    assert "never reached in 1 of 3 pieces (mm/s): line 4" in result.output
    assert "S100 (line 3): has no effect here" in result.output
    assert "/ (line 5): is carried out; --block-delete leaves such blocks out" in result.output


def test_options_shift_and_shorten_a_part_program(part: Path) -> None:
    result = RUNNER.invoke(app, [*CHECK, str(part), "--g54", "y=-7.5,x=1", "--block-delete"])
    assert result.exit_code == 0
    assert "x: 0.000 to 21.100 mm" in result.output
    assert "y: -7.500 to 0.000 mm" in result.output
    assert "G54 x 1, y -7.5 mm" in result.output


def test_a_path_beyond_the_limits_is_refused_with_the_line_that_goes_there(part: Path) -> None:
    result = RUNNER.invoke(app, [*CHECK, str(part), "--g54", "x=90"])
    assert isinstance(result.exception, ConfigError)
    assert result.exception.key == "line 3"  # line 4 goes farther, but line 3 leaves
    assert "axis x: position 110.1" in result.exception.reason
    assert "is beyond the limit 100 mm" in result.exception.reason


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--g54", "x"], "is not of the kind x=10,y=-2.5"),
        (["--g54", "x=1,x=2"], "is not of the kind x=10,y=-2.5"),
        (["--g54", "x=nan"], "is not of the kind x=10,y=-2.5"),
        (["--g54", "x=1e30"], "is not of the kind x=10,y=-2.5"),
    ],
)
def test_ill_formed_offsets_are_usage_errors(part: Path, options: list[str], reason: str) -> None:
    result = RUNNER.invoke(app, [*CHECK, str(part), *options], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    assert reason in result.output


@pytest.mark.parametrize("options", [["--g54", "x=1"], ["--block-delete"]])
def test_options_of_part_programs_are_refused_with_others(options: list[str]) -> None:
    result = RUNNER.invoke(app, [*CHECK, str(PROGRAMS / "circles.toml"), *options], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    assert "is for part programs" in result.output


def test_an_error_in_a_part_program_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "part.tap"
    path.write_text("G0 X0 Y0\nG1 X5\n", encoding="utf-8")
    result = RUNNER.invoke(app, [*CHECK, str(path)])
    assert isinstance(result.exception, ConfigError)
    assert str(result.exception) == f"{path}: line 2: G1 needs a feed: F is missing, here or before"


@pytest.mark.parametrize("name", ["bracket.ngc", "star_inch.nc"])
def test_the_examples_pass_and_are_drawn(name: str, tmp_path: Path) -> None:
    picture = tmp_path / "path.png"
    result = RUNNER.invoke(app, [*CHECK, str(PROGRAMS / name), "--out", str(picture)])
    assert result.exit_code == 0
    assert "within limits" in result.output
    assert picture.stat().st_size > 10_000


def test_the_documented_dry_run_is_that_of_the_example() -> None:
    """Extents, blocks and remarks to the digit; times and speeds are those of the planner of the day."""
    page = (REPOSITORY / "docs" / "part_programs.md").read_text(encoding="utf-8")
    documented = re.search(r"```\nmachines/xy_table/programs/bracket\.ngc: .*?\n(.*?)```", page, re.DOTALL)
    assert documented
    output = RUNNER.invoke(app, [*CHECK, str(PROGRAMS / "bracket.ngc")]).output
    for line in documented[1].splitlines():
        expected = line.partition(", up to")[0] if "up to" in line else line
        expected = expected.partition("path of")[0].partition("the feed is reached on")[0]
        assert expected in output


def test_a_part_that_was_made_on_a_full_disk_ends_with_what_could_not_be_written(
    part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    machine = load_machine(XY_TABLE)
    (tmp_path / "r").mkdir()
    whole, program = replace(REPORT, completed=True, recording=tmp_path / "r"), load_program(part, machine)
    with pytest.raises(typer.Exit) as ended:
        conclude(machine, whole.with_problem("No space left (10 rows lost)"), program)
    assert ended.value.exit_code == 1
    assert capsys.readouterr().err == "servo-ctrl: No space left (10 rows lost)\n"
    with pytest.raises(RecordingError, match="is not a recording"):
        conclude(machine, whole, program)
