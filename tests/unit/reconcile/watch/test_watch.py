"""Sequences of recordings by the batch twin: changes are reported with date and size."""

import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recording_series import FIRST_S, HOUR_S, model, record, strokes
from typer.testing import CliRunner

from kernels.arrays import Array
from reconcile.cli.main import app
from reconcile.errors import ReconcileError
from reconcile.watch import change_diagnosis
from reconcile.watch.history import WatchHistory
from reconcile.watch.watch import FILE, PAGE, Watch, WatchOptions

LUBRICATED, LUBRICATED_N = 9, 7.0
WORN, WORN_UM = 8, 0.3
PLAY = """[axis.NAME.drive_compliance]
stiffness_n_um = 200.0
damping_n_s_m = 5000.0
[axis.NAME.backlash]
play_um = {}"""
QUICK = WatchOptions(diagnose=False)


def far(rng: np.random.Generator) -> Array:
    """Return a motion unlike `strokes`: faster, with longer travel."""
    return strokes(rng, fast_mm_s=130.0, way_mm=20.0)


def watched(folder: Path, out: Path, options: WatchOptions = QUICK) -> Watch:
    return Watch(folder / "recordings", folder / "model" / "plant.toml", out, options)


def document(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / FILE).read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def lubricated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a sequence in which Coulomb friction falls from 10 N."""
    folder = tmp_path_factory.mktemp("lubricated")
    model(folder)
    for number in range(LUBRICATED + 3):
        coulomb_n = LUBRICATED_N if number >= LUBRICATED else 10.0
        record(folder, number, f"coulomb_n = {coulomb_n}", seed=1)
    return folder


@pytest.fixture(scope="module")
def lubrication_change(lubricated: Path) -> tuple[Path, list[dict[str, Any]]]:
    """Return the output folder, and the content of the detected changes."""
    out = lubricated / "out"
    return out, watched(lubricated, out).read_new()


def test_loss_of_lubrication_is_reported_with_date_and_size(
    lubrication_change: tuple[Path, list[dict[str, Any]]],
) -> None:
    out, changes = lubrication_change
    [change] = changes
    assert change["axis"] == "x"
    assert change["alarm"]["recording"] == f"run-{LUBRICATED + 1:03d}.parquet"
    assert change["began"]["recording"] == f"run-{LUBRICATED:03d}.parquet"
    low, high = change["began"]["interval95"]
    assert low <= change["began"]["recording"] <= high
    friction = change["moved"][0]
    assert friction["indicator"] == "coulomb_n"
    assert friction["after"] - friction["before"] == pytest.approx(LUBRICATED_N - 10.0, rel=0.1)
    assert friction["after_ci95"][0] < friction["after"] < friction["after_ci95"][1]
    assert change["where"][0]["coordinate"] == "direction"
    assert change["where"][0]["peak"] == pytest.approx(LUBRICATED_N - 10.0, rel=0.15)
    assert "a thermal cause is not excluded" in change["temperature"]
    assert document(out)["changes"][0]["sentence"] == change["sentence"]
    assert "Coulomb friction fell" in change["sentence"]


def test_page_opens_without_a_network_and_shows_the_change(
    lubrication_change: tuple[Path, list[dict[str, Any]]],
) -> None:
    out, [change] = lubrication_change
    page = (out / PAGE).read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert "Coulomb friction fell" in page
    assert change["began"]["recording"] in page
    head = page.split("<script>")[0]
    assert 'data-figure="x-force-coulomb_n"' in head
    assert 'src="' not in head


def test_a_restart_resumes_where_it_stopped(lubricated: Path, tmp_path: Path) -> None:
    out, folder = tmp_path / "out", tmp_path / "copy"
    shutil.copytree(lubricated / "model", folder / "model")
    shutil.copytree(lubricated / "recordings", folder / "recordings", ignore=lambda *_: late)
    assert watched(folder, out).read_new() == []
    before = document(out)
    for name in sorted(late):
        shutil.copy2(lubricated / "recordings" / name, folder / "recordings" / name)
        if name == f"run-{LUBRICATED:03d}.parquet":  # what was read is not read again
            for old in (folder / "recordings").glob("run-00[0-5]*"):
                old.unlink()
    again = watched(folder, out)
    [change] = again.read_new()
    assert change["began"]["recording"] == f"run-{LUBRICATED:03d}.parquet"
    assert document(out)["recordings"][: len(before["recordings"])] == before["recordings"]
    assert again.read_new() == []


late = {f"run-{number:03d}.parquet" for number in range(LUBRICATED, LUBRICATED + 3)}


def test_incomplete_files_wait_and_unusable_ones_are_reported(lubricated: Path, tmp_path: Path) -> None:
    folder, out = tmp_path / "some", tmp_path / "out"
    shutil.copytree(lubricated / "model", folder / "model")
    recordings = folder / "recordings"
    recordings.mkdir()
    whole = (lubricated / "recordings" / "run-000.parquet").read_bytes()
    growing = recordings / "run-000.parquet"
    growing.write_bytes(whole[: len(whole) // 2])
    os.utime(growing, (FIRST_S, FIRST_S))
    (recordings / "run-001.csv").write_text("time_s,motor_position_m\n0,0\n", encoding="utf-8")
    (recordings / "notes.txt").write_text("no recording", encoding="utf-8")
    unfinished = recordings / "run-002"
    unfinished.mkdir()
    (unfinished / "recording.json").write_text('{"finished": false}', encoding="utf-8")
    watch = watched(folder, out)
    watch.read_new()
    assert watch.recording_folder.unfinished == ["run-000.parquet", "run-001.csv", "run-002"]
    assert document(out)["recordings"] == []
    growing.write_bytes(whole)
    os.utime(recordings / "run-001.csv", (FIRST_S + HOUR_S,) * 2)
    watch.read_new()
    assert [entry["name"] for entry in document(out)["recordings"]] == ["run-000.parquet"]
    [refused] = document(out)["unusable"]
    assert refused["name"] == "run-001.csv"
    assert "force" in refused["why"]
    assert watch.recording_folder.unfinished == ["run-002"]


def test_growing_backlash_is_a_ramp_reported_once(tmp_path: Path) -> None:
    model(tmp_path)
    for number in range(WORN + 9):
        record(tmp_path, number, PLAY.format(0.5 + WORN_UM * max(number - WORN + 1, 0)), seed=2)
    watch = watched(tmp_path, tmp_path / "out")
    watch.read_new()
    [change] = watch.history.document["changes"]
    assert change["form"] == "ramp"
    low, high = change["began"]["interval95"]
    assert low <= f"run-{WORN:03d}.parquet" <= high
    lost = change["moved"][0]
    assert lost["indicator"] == "lost_motion_m"
    grown_m = 2e-6 * WORN_UM * 9
    assert lost["after"] - lost["before"] == pytest.approx(grown_m, rel=0.25)


def test_other_programs_and_temperatures_are_no_change(tmp_path: Path) -> None:
    """32 recordings: two programs, and friction that falls by 2 % a kelvin of the temperature beside it."""
    model(tmp_path)
    for number in range(32):
        warm_k = 4.0 * np.sin(number / 4.0)
        motion = far if number % 5 in {2, 3} else strokes
        friction = f"coulomb_n = {10.0 - 0.2 * warm_k}"
        record(tmp_path, number, friction, seed=3, motion=motion, temperature_k=295.0 + warm_k)
    watch = watched(tmp_path, tmp_path / "out")
    assert watch.read_new() == []
    assert len(watch.history.of_axis("x")) == 32


def test_command_names_the_physics(lubricated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(change_diagnosis, "RECORDINGS_PER_SIDE", 2)  # a diagnosis of four takes twice as long
    out = tmp_path / "out"
    command = ["watch", str(lubricated / "recordings"), "--model", str(lubricated / "model"), "--once"]
    result = CliRunner().invoke(app, [*command, "--out", str(out), "--axis", "x"])
    assert result.exit_code == 0, result.output
    assert "CHANGE: axis x" in result.output
    [change] = document(out)["changes"]
    assert change["named"]["verdict"] == "parameters"  # friction has another value, no new physics
    assert (out / change["named"]["model"]).exists()
    assert (out / change["named"]["report"]).exists()


def test_wrong_use_is_refused_with_its_reason(lubricated: Path, tmp_path: Path) -> None:
    with pytest.raises(ReconcileError, match="is not a directory"):
        Watch(tmp_path / "nowhere", lubricated / "model", tmp_path / "out", QUICK)
    with pytest.raises(ReconcileError, match="axis z: is not in the model"):
        watched(lubricated, tmp_path / "out", WatchOptions(axes=("z",)))
    for damaged in ('{"format": 0}', "[" * 100_000):
        (tmp_path / FILE).write_text(damaged, encoding="utf-8")
        with pytest.raises(ReconcileError, match="move it away"):
            WatchHistory.read(tmp_path / FILE)
