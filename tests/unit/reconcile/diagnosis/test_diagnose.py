"""A diagnosis from file to verdict: simulated effects are named, and written into a model that runs."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from nominal_model_text import WITH_SCALE

from hil_sim.config import load_plant
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError

T, N = 1e-3, 30_000
MASS_KG, VISCOUS_N_S_M, COULOMB_N = 50.0, 100.0, 12.0


def recorded(path: Path, *, cogging_n: float = 0.0, play_m: float = 0.0) -> Path:
    """An axis that sweeps back and forth; its forces by Newton's law, written out."""
    rng = np.random.default_rng(1)
    t = np.arange(N) * T
    x = 0.02 * np.sin(2.0 * math.pi * 0.31 * t) + 0.008 * np.sin(2.0 * math.pi * 1.13 * t + 1.0)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    force = MASS_KG * a + VISCOUS_N_S_M * v + COULOMB_N * np.sign(v)
    force += cogging_n * np.sin(2.0 * math.pi / 5e-3 * x) + rng.normal(size=N) * 0.3
    scale, place = np.empty(N), x[0]
    for i, motor in enumerate(x):
        place = min(max(place, motor - play_m), motor + play_m)
        scale[i] = place
    motor = np.round(x / 5e-9) * 5e-9
    columns = np.stack((t, motor, force, np.round(scale / 1e-7) * 1e-7), axis=1)
    np.savetxt(
        path,
        columns,
        delimiter=",",
        comments="",
        header="time_s,motor_position_m,motor_force_n,scale_position_m",
    )
    return path


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "nominal.toml"
    file.write_text(WITH_SCALE, encoding="utf-8")
    return file


def test_effects_in_both_residual_channels_are_named_quantified_and_written(
    tmp_path: Path, model: Path
) -> None:
    file = recorded(tmp_path / "r.csv", cogging_n=1.5, play_m=3e-6)
    found = diagnose([file], model, tmp_path / "out")
    content = json.loads(found.verdict_file.read_text(encoding="utf-8"))
    assert content["verdict"] == "effects"
    by_name = {finding["effect"]: finding for finding in content["findings"]}
    assert set(by_name) == {"cogging", "backlash"}
    amplitude, play = (
        by_name["cogging"]["parameters"]["amplitude"],
        by_name["backlash"]["parameters"]["play_m"],
    )
    assert amplitude["value"] == pytest.approx(1.5, rel=0.05)
    assert play["value"] == pytest.approx(3e-6, rel=0.05)
    fit = content["fit"]["x"]["force"]
    assert fit["after"]["heldout"] < 0.5 * fit["before"]["heldout"]
    repaired = load_plant(found.model_file).axes["x"]
    assert repaired.effects["backlash"].play_m == pytest.approx(3e-6, rel=0.05)
    assert repaired.effects["cogging"].amplitude_n[0] == pytest.approx(1.5, rel=0.05)
    assert repaired.drive.eds.exists()


def test_an_axis_that_agrees_with_its_model_is_consistent(tmp_path: Path, model: Path) -> None:
    assert (
        diagnose([recorded(tmp_path / "r.csv")], model, tmp_path / "out").verdict["verdict"] == "consistent"
    )


def test_wrong_values_are_reported_as_parameters(tmp_path: Path, model: Path) -> None:
    model.write_text(WITH_SCALE.replace("= 50.0", "= 40.0").replace("= 12.0", "= 9.0"), encoding="utf-8")
    found = diagnose([recorded(tmp_path / "r.csv")], model, tmp_path / "out")
    assert found.verdict["verdict"] == "parameters"
    assert load_plant(found.model_file).axes["x"].table.mass_kg == pytest.approx(50.0, rel=0.02)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no axis"),
        ("axis = 3", "no axis"),
        ("[axis.x.table]\nmass_kg = 1", r"axis\.x\.transmission\.lead_mm: a number is needed here"),
        ("[axis.x]\ntransmission.lead_mm = -5", r"lead_mm: must be positive"),
        ("{", "not TOML"),
    ],
)
def test_an_incomplete_model_is_refused(tmp_path: Path, model: Path, text: str, reason: str) -> None:
    model.write_text(text, encoding="utf-8")
    with pytest.raises(ReconcileError, match=reason):
        diagnose([tmp_path / "r.csv"], model, tmp_path / "out")
