"""A bad recording among good ones is set aside by name; alone it is refused."""

from pathlib import Path

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE

from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import NominalModel, load_model
from reconcile.recording.recording import load_recordings
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
