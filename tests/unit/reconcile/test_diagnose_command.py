"""`reconcile diagnose` at the command line: help, progress and exit status."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest
from typer.testing import CliRunner

from reconcile.cli.main import app, main
from reconcile.nominal_model.model_file import load_model
from servo_ctrl.files.whole_file import write_whole

MODEL = "[axis.x]\ntransmission.lead_mm = 5.0\nmotor.torque_constant_nm_a = 0.4\ntable.mass_kg = 50.0\n"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "axis.toml"
    file.write_text(MODEL, encoding="utf-8")
    return file


def arguments(model: Path, out: Path) -> list[str]:
    return ["diagnose", str(model.parent / "run.csv"), "--model", str(model), "--out", str(out)]


def test_help_teaches_by_an_example_that_a_model_file_can_be_made_of(tmp_path: Path) -> None:
    text = CliRunner(env={"COLUMNS": "120"}).invoke(app, ["diagnose", "--help"]).output
    assert "reconcile diagnose run1.csv --map" in text
    assert "Exit codes: 0 the verdict is written" in re.sub(r"\s+", " ", text)
    shown = [line.strip(" │") for line in text.splitlines()]
    first = shown.index("[axis.x]")
    file = tmp_path / "shown.toml"
    file.write_text("\n".join(shown[first : first + 4]), encoding="utf-8")
    assert load_model(file).axes["x"].mass_kg == 50.0


def test_a_file_that_cannot_be_used_ends_with_one_and_one_line(
    model: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["reconcile", *arguments(model, model.parent / "out")])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert lines[0] == "reading"
    assert len(lines) == 2
    assert "run.csv" in lines[1]


def test_ctrl_c_ends_with_130_and_leaves_nothing_half_written(
    model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = model.parent / "out"

    def interrupted(temporary: Path) -> NoReturn:
        temporary.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt

    def diagnosis(*given: Any, **_options: Any) -> NoReturn:
        on_progress: Callable[[str], None] = given[4]
        on_progress("report")
        out.mkdir()
        write_whole(out / "report.html", interrupted)
        raise AssertionError

    monkeypatch.setattr("reconcile.diagnosis.diagnose.diagnose", diagnosis)
    ended = CliRunner().invoke(app, arguments(model, out))
    assert ended.exit_code == 130
    assert list(out.iterdir()) == []


def test_wrong_use_ends_with_two(model: Path) -> None:
    assert CliRunner().invoke(app, ["diagnose", str(model)]).exit_code == 2


def test_linear_algebra_runs_in_one_thread_unless_the_environment_sets_another_number(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.argv", ["reconcile", "--help"])
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "")  # put back behind the test, which takes it away
    monkeypatch.delenv("OPENBLAS_NUM_THREADS")
    with pytest.raises(SystemExit):
        main()
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
    assert os.environ["OMP_NUM_THREADS"] == "3"
