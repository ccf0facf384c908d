"""Files of every release are read unchanged; those of a later release are refused with advice."""

import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from golden_formats import FORMATS, SCREW
from journal_examples import SETTINGS
from learned_examples import LEARNED, stroke_of

from hil_sim.config import ConfigError as PlantError
from hil_sim.config import load_plant
from hil_sim.node import storage
from hil_sim.node.storage import StoredParametersError
from reconcile.errors import ReconcileError
from reconcile.formats.readers import read_directory
from reconcile.nominal_model.model_file import load_model
from servo_ctrl.config.file_format import ADVICE, format_problem
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.part_program import PartProgram
from servo_ctrl.errors import ConfigError, ServoCtrlError
from servo_ctrl.hmi.access.users import Access, Role
from servo_ctrl.hmi.diagnosis.verdict import read_verdict
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.store import LearnedStore, ScrewStore
from servo_ctrl.learned.stroke_journal import StrokeJournal
from servo_ctrl.recording.command_log import COMMANDS_FILE, CommandLog
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.report.header import checked_header

RELEASES = sorted(path.name for path in FORMATS.iterdir() if path.is_dir())


@pytest.fixture(params=RELEASES)
def release(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Copy the files, because readers may write beside them, and git stores no modes."""
    copy = shutil.copytree(FORMATS / request.param, tmp_path / "release")
    (copy / "access.toml").chmod(0o600)
    return copy


def test_the_current_release_has_a_set_of_files() -> None:
    project = (FORMATS.parents[2] / "pyproject.toml").read_text(encoding="utf-8")
    version = re.search(r'^version = "(\d+\.\d+)', project, re.MULTILINE)
    assert version is not None
    assert version[1] in RELEASES


def test_recordings_and_captures_of_a_release_are_read(release: Path) -> None:
    recording = load_recording(release / "recording")
    assert recording.axes == ("x", "y")
    radius_m = np.hypot(
        recording.columns["x.position_command_m"] - 5e-3, recording.columns["y.position_command_m"] + 3e-3
    )
    np.testing.assert_allclose(radius_m, 0.02, rtol=1e-12)
    assert checked_header(release / "recording", recording.header).finished
    assert len(read_directory(release / "recording").columns) == len(recording.columns)
    capture = load_recording(release / "capture")
    assert capture.header["reason"] == "saved from the scope"
    assert len(capture.columns["time_s"]) == 200


def test_learned_results_and_the_journal_of_a_release_are_read(release: Path) -> None:
    machine = load_machine(release / "machines" / "xy_table")
    functions = LearnedStore(release / "learned", machine).active("x")
    assert functions is not None
    assert functions.learned == LEARNED
    screw = ScrewStore(release / "learned", machine).active("x")
    assert screw is not None
    assert screw.learned == SCREW
    journal = StrokeJournal(release / "learned", "x", SETTINGS, basis=LearnedFunctions.basis(machine, "x"))
    entries = journal.replay()
    assert journal.problem == ""
    for (stroke, result), (wanted, its_result) in zip(entries, map(stroke_of, range(2)), strict=True):
        assert stroke == wanted
        assert np.array_equal(result.error_m, its_result.error_m)


def test_machine_plant_and_programs_of_a_release_are_read(release: Path) -> None:
    folder = release / "machines" / "xy_table"
    machine = load_machine(folder)
    assert list(machine.axes) == ["x", "y"]
    assert len(load_program(folder / "programs" / "circles.toml", machine).steps) > 3
    part = load_program(folder / "programs" / "bracket.ngc", machine)
    assert isinstance(part, PartProgram)
    assert part.blocks == 24
    assert list(load_plant(folder).axes) == ["x", "y"]


def test_verdicts_models_and_the_other_files_are_read(release: Path) -> None:
    assert read_verdict(release / "diagnosis" / "verdict.json").verdict == "parameters"
    model = load_model(release / "diagnosis" / "model.toml")
    assert abs(model.axes["x"].mass_kg - 50.0) < 0.5
    assert load_plant(release / "diagnosis" / "model.toml").axes["x"].drive.node_id == 1
    assert [owner.role for owner in Access(release / "access.toml").owners()] == [Role.OPERATE]
    assert storage._read(release / "node_1.json") == {(0x6065, 0): b"\x10\x27\x00\x00"}
    log = CommandLog(release / COMMANDS_FILE, pytest.fail)
    log.add({"user": "bert"})
    assert log.close() == ""
    lines = [json.loads(line) for line in (release / COMMANDS_FILE).read_text().splitlines()]
    assert [(line["format"], line["user"]) for line in lines] == [(1, "anna"), (1, "bert")]


READERS: dict[str, tuple[str, Any, type[Exception]]] = {
    "recording": ("recording/recording.json", lambda path: load_recording(path.parent), ServoCtrlError),
    "machine": ("machines/xy_table/controller.toml", load_machine, ConfigError),
    "plant": ("machines/xy_table/plant.toml", load_plant, PlantError),
    "program": (
        "machines/xy_table/programs/circles.toml",
        lambda path: load_program(path, load_machine(path.parents[1])),
        ConfigError,
    ),
    "model": ("diagnosis/model.toml", load_model, ReconcileError),
    "verdict": ("diagnosis/verdict.json", read_verdict, ServoCtrlError),
    "stored parameters": ("node_1.json", storage._read, StoredParametersError),
}


def with_format(path: Path, number: int | None) -> None:
    """Set another format number in a JSON or TOML file; None removes it."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        document = json.loads(text)
        document.pop("format", None)
        text = json.dumps(document if number is None else {"format": number, **document})
    else:
        text = re.sub(r"^format = .*\n", "", text, flags=re.MULTILINE)
        text = text if number is None else f"format = {number}\n{text}"
    path.write_text(text, encoding="utf-8")


@pytest.mark.parametrize("kind", READERS)
def test_a_file_of_a_later_release_is_refused_with_advice(kind: str, release: Path) -> None:
    name, read, error = READERS[kind]
    with_format(release / name, 2)
    with pytest.raises(error, match=r"(?s)format.*2.*update") as refused:
        read(release / name)
    assert os.path.basename(name).removesuffix("/recording.json") in str(refused.value)  # noqa: PTH119  # text


@pytest.mark.parametrize("kind", READERS)
def test_a_file_without_a_format_number_has_the_first_format(kind: str, release: Path) -> None:
    name, read, _ = READERS[kind]
    with_format(release / name, None)
    read(release / name)


@pytest.mark.parametrize(("found", "known", "problem"), [
    (None, 1, ""), (1, 1, ""), (1, 3, ""), (3, 3, ""),
    (4, 3, f"has format 4, this software reads up to 3: {ADVICE}"),
    (0, 1, "format '0' is not a"), (True, 1, "format 'True' is not a"), ("1", 1, "format '1' is not a"),
])  # fmt: skip
def test_a_format_must_be_a_known_number(found: object, known: int, problem: str) -> None:
    assert format_problem(found, known).startswith(problem)
    assert bool(format_problem(found, known)) == bool(problem)
