"""The two examples on measured data: their scores with the data, the message without."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from hil_sim.physics.motor import cogging
from reconcile.cli.main import main
from reconcile.errors import ReconcileError
from reconcile.examples import emps as example_emps
from reconcile.examples import example
from reconcile.examples import odrive as example_odrive
from reconcile.examples.held_out_record import TwoRecords
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording

DATA = Path(__file__).parents[4].parent / "shared" / "data"
T, N = 1e-3, 15_000
MASS_KG, VISCOUS_N_S_M, COULOMB_N, RIPPLE_N, LEAD_M = 50.0, 100.0, 12.0, 1.5, 5e-3
MODEL = """
[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
"""


def recorded(seed: int, zero_m: float) -> AxisRecording:
    """An axis with a ripple once a turn, its forces by Newton's law written out; `zero_m`: of the encoder."""
    t = np.arange(N, dtype=np.float64) * T
    rng = np.random.default_rng(seed)
    pace = 0.31 + 0.05 * seed
    x = 0.02 * np.sin(2.0 * math.pi * pace * t) + 0.008 * np.sin(2.0 * math.pi * 1.13 * t + seed)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    force_n = MASS_KG * a + VISCOUS_N_S_M * v + COULOMB_N * np.sign(v)
    force_n += RIPPLE_N * np.sin(2.0 * math.pi / LEAD_M * x) + 0.3 * rng.normal(size=N)
    motor_m = np.round((x - zero_m) / 5e-9) * 5e-9
    return AxisRecording(f"record {seed}", "x", T, t, motor_m, force_n, None, None, None, {})


@pytest.mark.parametrize(
    ("name", "publisher"), [("emps", "nonlinearbenchmark.org"), ("odrive", "github.com/gchenfc/ODrive")]
)
def test_without_the_data_the_error_names_source_and_directory(
    name: str,
    publisher: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(example, "PLACES", (tmp_path / "shared", tmp_path / "data"))
    monkeypatch.setattr(sys, "argv", ["reconcile", "example", name, "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 1
    errors = capsys.readouterr().err
    assert publisher in errors
    assert str(tmp_path / "data") in errors
    assert not (tmp_path / "out").exists()


def test_the_rigid_model_is_fitted_to_newtons_law() -> None:
    found = example_emps.fitted_rigid(recorded(1, 0.0))
    assert found["mass_kg"] == pytest.approx(MASS_KG, rel=0.02)
    assert found["viscous_n_s_m"] == pytest.approx(VISCOUS_N_S_M, rel=0.05)
    assert found["coulomb_n"] == pytest.approx(COULOMB_N, rel=0.03)


def test_a_ripple_with_another_zero_holds_on_the_other_record(tmp_path: Path) -> None:
    file = tmp_path / "model.toml"
    file.write_text(MODEL, encoding="utf-8")
    zero_m = 1.7e-3
    records = TwoRecords(recorded(1, 0.0), recorded(2, zero_m), load_model(file).axes["x"])
    rigid, ripple = records.stages([("cogging", (1.0,))])
    assert rigid.heldout_n > 2.0 * ripple.heldout_n
    assert ripple.heldout_n == pytest.approx(ripple.train_n, rel=0.2)
    first, second = records.ripples([("cogging", (1.0,))])
    assert [first.amplitude_n, second.amplitude_n] == pytest.approx([RIPPLE_N, RIPPLE_N], rel=0.05)
    turned_rad = (second.phase_rad - first.phase_rad) % (2.0 * math.pi)
    assert turned_rad == pytest.approx(2.0 * math.pi * zero_m / LEAD_M, abs=0.05)
    loser = records.rejected_effect("position_dependent_friction", [("cogging", (1.0,))])
    assert loser.t < loser.needed


def test_the_residual_of_a_map_is_what_its_model_lacks() -> None:
    place = np.arange(512) / 512
    current_a = 0.3 + 0.8 * np.sin(7 * 2.0 * math.pi * place) + 0.6 * np.cos(28 * 2.0 * math.pi * place)
    pushed = cogging.Params(  # the table is pushed; the motor holds against it
        harmonic=(7.0,) + (0.0,) * 5, amplitude_n=(-0.8,) + (0.0,) * 5, phase_rad=(0.0,) * 6
    )
    one = example_odrive.Map(place * example_odrive.MM_A_TURN, current_a)
    assert example_odrive.unexplained_share(one, pushed) == pytest.approx(0.6)
    assert example_odrive.unexplained_share(one, cogging.NEUTRAL) == pytest.approx(1.0)


def test_a_map_runs_as_it_was_measured(tmp_path: Path) -> None:
    values = np.zeros(example_odrive.COUNTS)
    values[[16, 32, 48]] = 1.0, 2.0, 3.0
    file = tmp_path / "maps.npz"
    np.savez(
        file, cogging_measure_final_a=values, cogging_measure_final_er=values, cogging_measure_final_s=[1.0]
    )
    assert example_odrive.read_map(file, "a").current_a.tolist() == [1.0, 2.0, 3.0]
    assert example_odrive.read_map(file, "er").current_a.tolist() == [3.0, 2.0, 1.0]
    with pytest.raises(ReconcileError, match="is not in the file"):
        example_odrive.read_map(file, "b")
    with pytest.raises(ReconcileError, match="shape"):
        example_odrive.read_map(file, "s")


@pytest.mark.skipif(not (DATA / "emps").is_dir(), reason="the EMPS data are absent")
def test_emps_meets_its_bars(tmp_path: Path) -> None:
    shown = example_emps.run(DATA / "emps", tmp_path, lambda _text: None)
    values = shown.values
    for named in values["named"].values():
        assert {"asymmetric_viscous_friction", "cogging"} <= set(named)
        assert "position_dependent_friction" not in named
    first, second = values["ripples"]
    assert [first["amplitude_n"], second["amplitude_n"]] == pytest.approx([1.0, 0.85], abs=0.25)
    turned_m = (second["phase_rad"] - first["phase_rad"]) / (2.0 * math.pi) * 2.5e-3 % 2.5e-3
    assert turned_m == pytest.approx(values["origin_m"] % 2.5e-3, abs=2e-4)
    assert 0.3e-3 < values["timing_s"] < 1e-3
    assert values["rejected"]["t"] < values["rejected"]["needed"]
    assert values["stages"][-1]["heldout_n"] < 1.65  # the mark is 1.59
    assert values["blocks_n"]["train"]["after"]["heldout"] < 1.25
    assert values["replay"]["train"]["repaired"]["force_relative"] < 0.035  # published: 5.85 %
    assert values["replay"]["pulses"]["repaired"]["force_relative"] < 0.05  # published: 8.94 %
    for pair in values["replay"].values():
        assert pair["repaired"]["motor_rms_m"] < 0.6 * pair["nominal"]["motor_rms_m"]


@pytest.mark.skipif(not (DATA / "odrive_cogging").is_dir(), reason="the ODrive data are absent")
def test_odrive_meets_its_bars(tmp_path: Path) -> None:
    values = example_odrive.run(DATA / "odrive_cogging", tmp_path, lambda _text: None).values
    assert "cogging" in values["named"]
    assert [term["harmonic"] for term in values["harmonics"]][:2] == [7, 28]
    assert values["left"]["b_16"] <= 0.14
