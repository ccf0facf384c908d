"""Examples on published machines: their units, the message without data, and the page of their figures."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from reconcile.cli.main import main
from reconcile.examples import example
from reconcile.examples.real import study
from reconcile.examples.real.machine import Joint, Machine
from reconcile.examples.real.study import MACHINES, SETS
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings

CHECKOUT = Path(__file__).parents[4]
AXES = CHECKOUT.parent / "shared" / "data" / "axes"
PERIOD_S = 1e-3
PUBLISHERS = {
    "fditools": "github.com/HoriFujimotoLab/FdiTools",
    "kuka": "github.com/JonasWeigand/Robot_Identification",
    "dfki": "github.com/dfki-ric-underactuated-lab/double_pendulum",
    "kinova": "github.com/wissem01chiha/dynamic-identification",
    "bam": "github.com/Rhoban/bam",
}


def swing(data: Path) -> Machine:
    """Return synthetic data of two joints by Newton's law, instead of a file."""
    assert data.name == "nowhere"
    recordings = {}
    for number in range(3):
        t = np.arange(6000) * PERIOD_S
        pace = 2.0 * math.pi * (0.8 + 0.1 * number)
        rate, change = pace * np.cos(pace * t), -(pace**2) * np.sin(pace * t)
        torque = 0.3 * change + 0.8 * rate + 1.5 * np.sign(rate) + 2.0
        recordings[f"r{number}"] = {
            "time_s": t,
            "j.motor_position_rad": np.sin(pace * t),
            "j.motor_force_nm": torque,
        }
    return Machine("swing", "a swing", "a constant torque", {"j": Joint(0.3, 0.1, 4096, 8.0)}, recordings)


def test_files_hold_a_rotary_joint(tmp_path: Path) -> None:
    machine = swing(Path("nowhere"))
    nominal, paths = machine.written(tmp_path)
    axis = load_model(nominal).axes["j"]
    assert axis.rotary
    assert axis.lead_m == pytest.approx(2.0 * math.pi / 8.0)
    assert axis.mass_kg == pytest.approx(0.4)
    assert axis.motor_mass_kg == pytest.approx(0.1)
    assert axis.encoder_resolution_m is not None
    assert axis.encoder_resolution_m == pytest.approx(2.0 * math.pi / 4096)
    recording = load_recordings(paths[:1], load_model(nominal).axes)[0]
    assert recording.force_n == pytest.approx(machine.recordings["r0"]["j.motor_force_nm"])


def test_the_example_shows_the_residual_of_the_written_model_on_the_first_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MACHINES, "swing", swing)  # type: ignore[arg-type]  # a dictionary that is not written to
    result = study.run(["swing"], Path("nowhere"), tmp_path, lambda _text: None)
    left = result.values["swing"]["axes"]["j"]["left_nm"]
    assert left["rigid"] == pytest.approx(2.0, rel=0.05)
    assert left["written model"] < 0.1
    assert all(file.exists() for file in result.files)


@pytest.mark.parametrize("name", SETS)
def test_without_the_data_the_message_names_the_publisher(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(example, "PLACES", (tmp_path / "shared", tmp_path / "data"))
    monkeypatch.setattr(sys, "argv", ["reconcile", "example", name, "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 1
    assert PUBLISHERS[name] in capsys.readouterr().err


@pytest.mark.parametrize("name", MACHINES)
def test_every_published_machine_is_read(name: str, tmp_path: Path) -> None:
    if not AXES.is_dir():
        pytest.skip("../shared/data/axes is absent")
    machine = MACHINES[name](AXES)
    nominal, paths = machine.written(tmp_path)
    recordings = load_recordings(paths, load_model(nominal).axes)
    assert {recording.axis for recording in recordings} == set(machine.joints)
