"""A bad recording among good ones is set aside by name; alone it is refused."""

from pathlib import Path

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE

from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import NominalModel, load_model
from reconcile.recording.recording import load_recordings
from reconcile.recording.sensor_finding import SensorFinding, notes_of
from reconcile.sensing.checks import examine

T, N = 1e-3, 8_000


@pytest.fixture
def model(tmp_path: Path) -> NominalModel:
    (tmp_path / "nominal.toml").write_text(WITHOUT_SCALE, encoding="utf-8")
    return load_model(tmp_path / "nominal.toml")


def recorded(path: Path, *, sign: float = 1.0, spring_n_m: float = 0.0) -> Path:
    """An axis of 50 kg with friction, and a spring that pulls it to its middle."""
    rng, t = np.random.default_rng(4), np.arange(N) * T
    x = 0.02 * np.sin(2.1 * t) + 0.008 * np.sin(7.1 * t + 1.0)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + spring_n_m * x + rng.normal(size=N) * 0.3
    columns = np.stack((t, np.round(x / 5e-9) * 5e-9, sign * force), axis=1)
    header = "time_s,motor_position_m,motor_force_n"
    np.savetxt(path, columns, delimiter=",", comments="", header=header)
    return path


def test_a_turned_force_among_good_recordings_is_set_aside_by_name(
    tmp_path: Path, model: NominalModel
) -> None:
    files = [recorded(tmp_path / "good.csv"), recorded(tmp_path / "turned.csv", sign=-1.0)]
    report = examine(load_recordings(files, model.axes), model.axes)
    assert [Path(one.source).name for one in report.recordings] == ["good.csv"]
    [aside] = [one for one in report.findings if "set aside" in one.message]
    assert Path(aside.source).name == "turned.csv"
    assert "against the motion" in aside.message


def test_a_turned_force_alone_is_refused(tmp_path: Path, model: NominalModel) -> None:
    files = [recorded(tmp_path / "turned.csv", sign=-1.0)]
    with pytest.raises(ReconcileError, match="against the motion"):
        examine(load_recordings(files, model.axes), model.axes)


def test_a_spring_that_outweighs_the_inertia_is_no_wrong_sign(tmp_path: Path, model: NominalModel) -> None:
    files = [recorded(tmp_path / "spring.csv", spring_n_m=4000.0)]
    report = examine(load_recordings(files, model.axes), model.axes)
    assert len(report.recordings) == 1
    assert not any(one.check == "sign" for one in report.findings)


def test_findings_that_differ_in_numbers_alone_are_one_note_with_their_count() -> None:
    def gap(start_s: float, lost: int) -> SensorFinding:
        message = f"{lost} samples are missing after {start_s:.4f} s; the recording is split there"
        source = f"run.csv [{start_s:.3f} to {start_s + 1.0:.3f} s]"
        return SensorFinding("gap", "warning", source, "x", "", start_s, start_s, lost, "samples", message)

    other = SensorFinding("gap", "note", "run.csv", "y", "", 0.0, 0.0, 2.0, "samples", "2 are missing")
    found = notes_of([gap(1.0, 7), gap(2.0, 9), other, gap(3.5, 8)])
    largest = "run.csv: x: 9 samples are missing after 2.0000 s; the recording is split there"
    assert found == [f"{largest} (x 3, 1.000 to 3.500 s; the largest is shown)", "run.csv: y: 2 are missing"]
