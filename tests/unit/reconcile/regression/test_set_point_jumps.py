"""A drive that closes the position loop cuts teeth into its force; without them the mass is the true one."""

from pathlib import Path

import numpy as np
import pytest
from concealed_machine import motion, write_machine

from hil_sim.config import load_plant
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.nominal_axis import DriveLoops, NominalAxis
from reconcile.nominal_model.model_file import load_model, write_model
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem
from reconcile.regression.resolution import force_step_n
from reconcile.regression.set_point_jumps import force_without_teeth_n, missing_share
from reconcile.replay.along_reference import along_reference

WINDING = "[axis.NAME.winding]\nresistance_ohm = 3.0\ninductance_mh = 10.0\n"
T = 1e-3


def led(reference_m: np.ndarray, mode: str = "csp") -> AxisRecording:
    zeros = np.zeros(len(reference_m))
    return AxisRecording(
        source="run.csv",
        axis="x",
        period_s=T,
        time_s=np.arange(len(reference_m)) * T,
        motor_m=reference_m,
        force_n=zeros,
        scale_m=None,
        reference_m=reference_m,
        temperature_k=None,
        others={},
        force_command_n=None,
        start_s=0.0,
        findings=[],
        ignored=[],
        origins={},
        mode=mode,
    )


@pytest.fixture(scope="module", params=["", WINDING], ids=["no lag", "lag of the current"])
def run(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[AxisRecording, Path]:
    """A run in csp, recorded as the controller does: a set point acts one cycle later. Its plant file."""
    folder = write_machine(tmp_path_factory.mktemp("csp"), {"x": request.param}, motion()[:, None])
    plant = folder / "plant.toml"
    text = plant.read_text(encoding="utf-8")
    stiff = {
        "velocity_gain_n_s_m = 2500.0": "velocity_gain_n_s_m = 9000.0",
        "peak_current_a = 4.5": "peak_current_a = 20.0",
    }
    for before, after in stiff.items():
        text = text.replace(before, after)
    plant.write_text(text, encoding="utf-8")
    reference_m = np.concatenate((np.zeros(300), motion(), np.zeros(300)))
    simulated = along_reference(led(reference_m), load_plant(plant))
    assert simulated is not None
    later = {name: np.append(0.0, getattr(simulated, name)[:-1]) for name in ("force_n", "motor_m")}
    return simulated._replace(**later), plant


def mass_kg(recording: AxisRecording, axis: NominalAxis) -> float:
    data = regression_data(recording, axis)
    problem = regression_problem([data], ResidualChannel.FORCE, [("transport_delay", (2.5e-4,))], only=True)
    target, columns = problem.target_and_columns(0)
    used = problem.used[0]
    fitted, *_ = np.linalg.lstsq(columns[used], target[used], rcond=None)
    return float(fitted[0])


def test_the_mass_is_the_true_one_without_the_teeth_and_too_small_with_them(
    run: tuple[AxisRecording, Path],
) -> None:
    recording, plant = run
    axis = load_model(plant).axes["x"]
    assert mass_kg(recording, axis) == pytest.approx(axis.mass_kg, rel=0.005)
    with_teeth_kg = mass_kg(recording._replace(mode="cst"), axis)
    share = missing_share(T, axis.drive_loops.current_lag_s)
    assert axis.mass_kg - with_teeth_kg == pytest.approx(share * 9000.0 * T, rel=0.15)


def test_the_step_of_the_force_is_that_of_the_recording(run: tuple[AxisRecording, Path]) -> None:
    recording, plant = run
    axis, step_n = load_model(plant).axes["x"], 0.5
    rounded = recording._replace(force_n=np.round(recording.force_n / step_n) * step_n)
    for one in (rounded, rounded._replace(mode="cst")):
        assert force_step_n(regression_data(one, axis)) == pytest.approx(step_n)


def test_other_modes_means_and_unknown_gains_are_as_recorded(run: tuple[AxisRecording, Path]) -> None:
    recording, plant = run
    axis = load_model(plant).axes["x"]
    assert not np.array_equal(force_without_teeth_n(recording, axis), recording.force_n)
    for other in (
        recording._replace(mode="cst"),
        recording._replace(reference_m=None),
        recording._replace(samples_in_a_mean=4),
    ):
        assert np.array_equal(force_without_teeth_n(other, axis), other.force_n)
    unknown = axis._replace(drive_loops=DriveLoops())
    assert np.array_equal(force_without_teeth_n(recording, unknown), recording.force_n)


def test_a_written_file_has_no_gains_for_an_unknown_drive(tmp_path: Path) -> None:
    file = tmp_path / "axis.toml"
    file.write_text(
        "[axis.x]\ntransmission.lead_mm = 5.0\nmotor.torque_constant_nm_a = 0.4\ntable.mass_kg = 50.0\n",
        encoding="utf-8",
    )
    model = load_model(file)
    write_model(model, {}, tmp_path / "model.toml")
    for read in (model, load_model(tmp_path / "model.toml")):
        assert read.axes["x"].drive_loops == DriveLoops()


def test_a_sample_lacks_half_a_tooth_and_less_behind_a_lag() -> None:
    assert missing_share(1e-3, 0.0) == 0.5
    assert missing_share(1e-3, 1e-9) == pytest.approx(0.5, abs=1e-5)
    assert missing_share(1e-3, 1.6e-4) == pytest.approx(0.342, abs=2e-3)
    assert missing_share(1e-3, 1.0) == pytest.approx(0.0, abs=1e-3)
