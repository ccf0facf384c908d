"""Files that can be chosen for a diagnosis, and acceptance of the updated model."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from stub_link import StubLink

from servo_ctrl.files.arrow import write_part
from servo_ctrl.hmi.diagnosis.job_files import (
    AxisMotion,
    FilesError,
    accept_model,
    models_in,
    read_model,
    recordings_below,
)
from servo_ctrl.hmi.diagnosis.page import excitation_text, recording_text
from servo_ctrl.hmi.shell.program_jobs import log_action
from servo_ctrl.hmi.shell.units import MM
from servo_ctrl.recording.channels import channels_of

REPOSITORY = Path(__file__).parents[3]
MODEL = '[axis.x.drive]\nnode_id = 1\neds = "../eds/drive.eds"\n[axis.x.table]\nmass_kg = 51.0\n'
OLD = "[axis.x.table]\nmass_kg = 50.0\n"


@pytest.fixture
def repaired(tmp_path: Path) -> Path:
    job = tmp_path / "jobs" / "one"
    job.mkdir(parents=True)
    (job / "model.toml").write_text(MODEL)
    return job / "model.toml"


def recording(directory: Path, started: str) -> None:
    directory.mkdir(parents=True)
    (directory / "recording.json").write_text(json.dumps({"started": started, "program": "circles.toml"}))


def test_recordings_are_found_below_the_directory_the_newest_first(tmp_path: Path) -> None:
    recording(tmp_path / "a", "2026-01-01T00:00:00Z")
    recording(tmp_path / "runs" / "b", "2026-03-01T00:00:00Z")
    recording(tmp_path / "c", "2026-02-01T00:00:00Z")
    recording(tmp_path / "too" / "deep" / "by" / "far", "2026-04-01T00:00:00Z")
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / "recording.json").write_text("{")
    (tmp_path / "nested").mkdir()
    (tmp_path / "nested" / "recording.json").write_text("[" * 100_000)
    (tmp_path / "link").symlink_to(tmp_path / "a")
    found = recordings_below(tmp_path)
    assert [one.name for one in found] == ["runs/b", "c", "a"]
    assert found[0].program == "circles.toml"
    assert recordings_below(tmp_path / "nowhere") == []


def test_the_models_of_a_machine_are_found_without_its_controller() -> None:
    names = [path.name for path in models_in(REPOSITORY / "machines" / "xy_table")]
    assert names == ["plant.toml", "plant_lubrication_loss.toml"]
    assert list(read_model(REPOSITORY / "machines" / "xy_table" / "plant.toml")["axis"]) == ["x", "y"]


def test_the_accepted_model_is_the_repaired_one_and_its_paths_lead_to_the_same_files(
    tmp_path: Path, repaired: Path
) -> None:
    (tmp_path / "machine").mkdir()
    target = tmp_path / "machine" / "plant.toml"
    assert accept_model(repaired, target, "ada\n[x]") is None
    written = tomllib.loads(target.read_text())
    eds = written["axis"]["x"]["drive"].pop("eds")
    wanted = tomllib.loads(MODEL)
    assert (target.parent / eds).resolve() == (
        repaired.parent / wanted["axis"]["x"]["drive"].pop("eds")
    ).resolve()
    assert written == wanted
    assert "accepted by ada[x] at 2" in target.read_text().splitlines()[0]


def test_the_old_model_is_kept_however_often_one_is_accepted(tmp_path: Path, repaired: Path) -> None:
    target = tmp_path / "plant.toml"
    target.write_text(OLD)
    kept = [accept_model(repaired, target, "ada") for _ in range(3)]
    assert len(set(kept)) == 3
    assert kept[0] is not None
    assert kept[0].read_text() == OLD
    assert tomllib.loads(target.read_text())["axis"]["x"]["table"]["mass_kg"] == 51.0
    assert not list(tmp_path.glob("*.tmp"))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("plant.txt", r"ends in \.toml"),
        ("nowhere/plant.toml", "no such directory"),
        ("controller.toml", "exists and is not a model"),
        ("notes.toml", "exists and is not a model"),
    ],
)
def test_an_invalid_place_for_a_model_is_refused_and_left_alone(
    tmp_path: Path, repaired: Path, name: str, reason: str
) -> None:
    (tmp_path / "controller.toml").write_text("[axis.x.control]\nkp = 1\n")
    (tmp_path / "notes.toml").write_text("= no TOML")
    before = {path: path.read_text() for path in tmp_path.glob("*.toml")}
    with pytest.raises(FilesError, match=reason):
        accept_model(repaired, tmp_path / name, "ada")
    assert {path: path.read_text() for path in tmp_path.glob("*.toml")} == before


def test_a_diagnosis_without_a_model_is_not_accepted(tmp_path: Path) -> None:
    with pytest.raises(FilesError, match="cannot be read"):
        accept_model(tmp_path / "model.toml", tmp_path / "plant.toml", "ada")
    assert not (tmp_path / "plant.toml").exists()


def test_the_log_has_a_line_for_each_action(tmp_path: Path) -> None:
    log = tmp_path / "below" / "reconcile.jsonl"
    log_action(log, "ada", "accept", {"target": tmp_path})
    log_action(log, "bob", "cancel", {})
    first, second = map(json.loads, log.read_text().splitlines())
    assert (first["who"], first["what"], first["target"]) == ("ada", "accept", str(tmp_path))
    assert second["who"] == "bob"
    assert log.stat().st_mode & 0o077 == 0


def test_the_list_shows_length_travel_and_whether_a_recording_is_usable(tmp_path: Path) -> None:
    link = StubLink()
    link.advance(1000)
    rows = link.rows.since(0)[1]
    rows[:, link.rows.place("y.motor_position_m")] = 0.003
    rows[:, link.rows.place("x.velocity_command_m_s")] = 0.01  # the stub's circle, one way
    header = {
        "started": "2026-01-01T10:00:00Z",
        "program": "a/circles.toml",
        "period_s": 0.001,
        "axes": ["x", "y"],
    }
    for name, count in (("one", 1000), ("short", 100)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "recording.json").write_text(json.dumps(header))
        write_part(tmp_path / name / "part-00000.parquet", channels_of(["x", "y"]), rows[:count])
    recording(tmp_path / "empty", "2025-01-01T00:00:00Z")
    found = {one.name: one for one in recordings_below(tmp_path)}
    travel_m = np.ptp(rows[:, link.rows.place("x.motor_position_m")])
    assert found["one"].axes[0].travel_m == pytest.approx(travel_m)
    assert recording_text(found["one"], MM) == (
        f"one \N{MIDDLE DOT} 2026-01-01 10:00 \N{MIDDLE DOT} circles.toml \N{MIDDLE DOT} 1 s \N{MIDDLE DOT} "
        f"X {MM.length.with_unit(travel_m)}, Y 0.0000 mm"
    )
    text = excitation_text(found["one"])
    assert "X moves in one direction only" in text
    assert "Y stands still" in text
    assert "too short" in excitation_text(found["short"])
    assert "no rows" in excitation_text(found["empty"])
    both = found["one"]._replace(axes=(AxisMotion("x", 0.05, both_ways=True),))
    assert excitation_text(both) == "\N{CHECK MARK} every axis moves in both directions"
