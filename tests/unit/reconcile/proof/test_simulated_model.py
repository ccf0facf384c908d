"""A soft plant, held against its own file, is consistent; what it lacks is still named."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from concealed_effects import twin_recording

from hil_sim.config import load_plant
from reconcile.diagnosis.diagnose import WrittenDiagnosis, diagnose
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.replay.model_along_motion import along_motion

ROOT = Path(__file__).parents[4]
SLOW_HZ = 18.0
"""Standard deviation of the low pass within which the simulation is held against the recording."""
PROGRAM = """
[[step]]
kind = "sine"
label = "sine"
axis = "x"
amplitude_mm = 12.0
frequency_hz = 0.5
cycles = 3.0
"""
COGGING = """
[axis.x.cogging]
amplitude_n = [40.0, 0.0, 0.0]
harmonic = [4.0, 6.0, 8.0]
phase_deg = [90.0, 0.0, 0.0]
"""


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The soft table of Xia et al. with a program of its own."""
    folder = tmp_path_factory.mktemp("soft")
    shutil.copytree(ROOT / "eds", folder / "eds")
    place = folder / "machines" / "fuzzy_table"
    shutil.copytree(ROOT / "machines" / "fuzzy_table", place)
    (place / "program.toml").write_text(PROGRAM, encoding="utf-8")
    return place


def diagnosed(recording: Path, model: Path) -> WrittenDiagnosis:
    out = recording.parent / f"{recording.stem}_verdict"
    return diagnose([recording], model, out, with_report=False, with_next=False, with_proof=False)


def test_a_soft_table_against_its_own_plant_has_no_name(machine: Path) -> None:
    plant = machine / "plant.toml"
    recording = twin_recording(machine, plant, machine / "own.parquet")
    verdict = diagnosed(recording, plant).verdict
    assert (verdict["verdict"], verdict["findings"]) == ("consistent", [])
    assert verdict["accounted"]["x"]["force"]["is_noise"]
    # the columns do miss something of this plant: without its image there would be a name
    assert any("simulated along this motion" in one["why"] for one in verdict["withdrawn"])
    assert verdict["accounted"]["x"]["force"]["left"] > 0.01 * verdict["accounted"]["x"]["force"]["measured"]

    model = load_model(plant)
    [own] = load_recordings([recording], model.axes)
    image = along_motion(own, load_plant(plant))
    slow = np.exp(-0.5 * (np.fft.rfftfreq(len(own.force_n), own.period_s) / SLOW_HZ) ** 2)
    left, whole = (np.fft.irfft(np.fft.rfft(of) * slow) for of in (image.force_n - own.force_n, own.force_n))
    assert left.std() < 0.06 * whole.std()


def test_a_ripple_that_the_soft_table_lacks_is_named(machine: Path) -> None:
    plant = machine / "plant.toml"
    rippled = machine / "rippled.toml"
    rippled.write_text(plant.read_text(encoding="utf-8") + COGGING, encoding="utf-8")
    recording = twin_recording(machine, rippled, machine / "rippled.parquet")
    findings = diagnosed(recording, plant).verdict["findings"]
    assert [f["effect"] for f in findings] == ["cogging"]
