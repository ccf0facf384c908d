"""Wrongly mapped channels are reported with the `--map` that corrects them; right ones are accepted."""

from pathlib import Path

import numpy as np
import pytest
from axis_motion import Axis, clean

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.formats.mapping import parse_mapping
from reconcile.recording.recording import AxisRecording, load_recordings
from reconcile.recording.sensor_finding import SensorFinding
from reconcile.sensing.checks import examine
from reconcile.sensing.units import rigid_columns
from reconcile.sensing.wrong_channels import is_unsigned

MODEL = {"x": Axis()}
CLEAN = clean(source="run.csv")
NOISE = np.random.default_rng(3).normal(0.0, 0.3, len(CLEAN.time_s))


def written(path: Path, names: str, *columns: Array) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=names, comments="", fmt="%.10g")
    return path


def refused(path: Path, *mapping: str, model: dict[str, Axis] | None = None) -> str:
    axes = model or MODEL
    with pytest.raises(ReconcileError) as error:
        examine(load_recordings([path], axes, parse_mapping(mapping)), axes)
    return str(error.value)


def warned(path: Path, *mapping: str) -> list[SensorFinding]:
    return examine(load_recordings([path], MODEL, parse_mapping(mapping)), MODEL).findings


WRONG_UNITS: list[tuple[str, float, float, str]] = [
    ("position in mm", 1e3, 1.0, "x.position=q*0.001"),
    ("position in counts", 1.0 / 5e-8, 1.0, "x.position=q*5e-08"),
    ("position in turns", 1.0 / 10e-3, 1.0, "x.position=q*0.01"),
    ("force in kN", 1.0, 1e-3, "x.force=F*1000"),
    ("force in A", 1.0, 1.0 / 270.0, "x.force=F*270"),
    ("force turned round", 1.0, -1.0, "x.force=F*-1"),
]


@pytest.mark.parametrize(
    ("position", "force", "entry"), [of[1:] for of in WRONG_UNITS], ids=[of[0] for of in WRONG_UNITS]
)
def test_a_wrong_unit_is_reported_with_the_map_that_corrects_it(
    position: float, force: float, entry: str, tmp_path: Path
) -> None:
    path = written(
        tmp_path / "run.csv", "t,q,F", CLEAN.time_s, CLEAN.motor_m * position, CLEAN.force_n * force
    )
    said = refused(path, "time=t,position=q,force=F")
    assert f"--map {entry}" in said
    assert warned(path, "time=t,position=q,force=F".replace(f"{entry[2:].partition('*')[0]}", entry)) == []


def test_a_magnitude_of_the_current_is_recognised_and_unused_columns_are_named(tmp_path: Path) -> None:
    current_a = (CLEAN.force_n + NOISE) / 270.0
    path = written(
        tmp_path / "run.csv", "t,q,i_rms,i_q", CLEAN.time_s, CLEAN.motor_m, np.abs(current_a), current_a
    )
    said = refused(path, "time=t,position=q,current=i_rms")
    assert "no sign" in said
    assert "--map x.current=NAME (columns not used: i_q)" in said
    assert warned(path, "time=t,position=q,current=i_q") == []


def test_an_axis_with_a_load_that_never_changes_its_sign_is_no_magnitude() -> None:
    for load_n in (150.0, -150.0):
        columns = rigid_columns(CLEAN.motor_m, CLEAN.force_n + load_n, CLEAN.period_s)
        assert columns is not None
        assert np.all(columns.force_n > 0.0) == (load_n > 0.0)
        assert not is_unsigned(columns)


def two_axes(path: Path, *, exchanged: bool) -> Path:
    t = CLEAN.time_s
    envelope = np.sin(np.pi * np.clip(t / t[-1], 0.0, 1.0)) ** 2
    y_m = envelope * (0.015 * np.sin(2.0 * np.pi * 0.43 * t) + 0.004 * np.sin(2.0 * np.pi * 1.7 * t))
    velocity = np.gradient(y_m, t)
    y_n = 60.0 * np.gradient(velocity, t) + 20.0 * np.tanh(velocity / 1e-4) + 150.0 * velocity + NOISE
    forces = (y_n, CLEAN.force_n) if exchanged else (CLEAN.force_n, y_n)
    return written(path, "t,qx,Fx,qy,Fy", CLEAN.time_s, CLEAN.motor_m, forces[0], y_m, forces[1])


def test_exchanged_forces_of_two_axes_are_reported(tmp_path: Path) -> None:
    mapping = "time=t,x.position=qx,x.force=Fx,y.position=qy,y.force=Fy"
    axes = {"x": Axis(), "y": Axis()}
    path = two_axes(tmp_path / "swapped.csv", exchanged=True)
    assert "--map x.force=Fy*1,y.force=Fx*1" in refused(path, mapping, model=axes)
    right = two_axes(tmp_path / "right.csv", exchanged=False)
    findings = examine(load_recordings([right], axes, parse_mapping([mapping])), axes).findings
    assert [f for f in findings if f.severity != "note" and f.check in {"sign", "unit", "exchanged"}] == []


@pytest.mark.parametrize(
    ("mapping", "position", "mended"),
    [
        ("position=F,force=q", 1.0, "x.position=q*1,x.force=F*1"),
        ("position=F*0.001,force=q", 1e3, "x.position=q*0.001,x.force=F*1"),
    ],
    ids=["each in its unit", "each in the other's unit"],
)
def test_exchanged_position_and_force_are_reported(
    mapping: str, position: float, mended: str, tmp_path: Path
) -> None:
    path = written(tmp_path / "run.csv", "t,q,F", CLEAN.time_s, CLEAN.motor_m * position, CLEAN.force_n)
    said = refused(path, f"time=t,{mapping}")
    assert "position and force are exchanged" in said
    assert f"--map {mended}" in said
    assert warned(path, f"time=t,{mended}") == []


def test_a_motor_ahead_of_its_command_is_reported(tmp_path: Path) -> None:
    assert CLEAN.reference_m is not None
    path = written(
        tmp_path / "run.csv", "t,act,cmd,F", CLEAN.time_s, CLEAN.motor_m, CLEAN.reference_m, CLEAN.force_n
    )
    assert warned(path, "time=t,position=act,reference=cmd,force=F") == []
    found = warned(path, "time=t,position=cmd,reference=act,force=F")
    [finding] = [one for one in found if one.check == "exchanged"]
    assert finding.size == pytest.approx(-0.01, abs=1e-3)
    assert "--map x.position=act*1,x.reference=cmd*1" in str(finding)


def test_an_axis_that_stood_while_another_moved_is_set_aside(tmp_path: Path) -> None:
    still = np.full_like(CLEAN.motor_m, 0.25)
    path = written(
        tmp_path / "run.csv", "t,qx,Fx,qy,Fy", CLEAN.time_s, CLEAN.motor_m, CLEAN.force_n, still, NOISE
    )
    axes = {"x": Axis(), "y": Axis()}
    mapping = parse_mapping(["time=t,x.position=qx,x.force=Fx,y.position=qy,y.force=Fy"])
    report = examine(load_recordings([path], axes, mapping), axes)
    assert [recording.axis for recording in report.recordings] == ["x"]
    assert [(f.axis, f.check, f.severity) for f in report.findings] == [("y", "constant", "warning")]


def presliding(amplitude_m: float) -> AxisRecording:
    """Return a recording with a presliding force: 10 N/um up to 20 N."""
    t = CLEAN.time_s
    position_m = amplitude_m * np.sin(2.0 * np.pi * 0.5 * t) * np.minimum(t, 1.0)
    force_n = 20.0 * np.tanh(position_m * 10e6 / 20.0) + NOISE
    count_m = 5e-9
    return CLEAN._replace(
        motor_m=np.round(position_m / count_m) * count_m,
        force_n=force_n,
        scale_m=None,
        reference_m=None,
        force_command_n=None,
    )


@pytest.mark.parametrize("amplitude_m", [5e-6, 2e-6])
def test_sines_within_presliding_are_not_refused(amplitude_m: float) -> None:
    fine = {"x": Axis(encoder_resolution_m=5e-9)}
    report = examine([presliding(amplitude_m)], fine)
    assert [f for f in report.findings if f.severity == "unusable"] == []
    assert len(report.recordings) == 1


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_slow_joint_whose_weight_hides_its_mass_is_told_that_its_columns_are_exchanged(
    tmp_path: Path, *, exchanged: bool
) -> None:
    t = np.arange(0.0, 12.0, 2e-3)
    angle_rad = 0.7 * np.sin(0.8 * t) + 0.2 * np.sin(1.7 * t)
    torque_nm = 9.0 * np.sin(angle_rad) - 0.8 * np.sign(np.gradient(angle_rad, t))  # carried by other joints
    torque_nm += np.random.default_rng(8).normal(0.0, 0.05, len(t))
    path = written(tmp_path / "joint.csv", "t,q,tau", t, angle_rad, torque_nm)
    model = {"x": Axis(rotary=True, mass_kg=0.4, encoder_resolution_m=None)}
    columns = ("time=t,position=tau,force=q",) if exchanged else ("time=t,position=q,force=tau",)
    if exchanged:
        said = refused(path, *columns, model=model)
        assert "position and force are exchanged" in said
        assert "--map x.position=q*1,x.force=tau*1" in said
    else:
        findings = examine(load_recordings([path], model, parse_mapping(columns)), model).findings
        assert [one for one in findings if one.check == "exchanged"] == []
