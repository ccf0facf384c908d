"""The same motion from every format, and clear errors for unreadable files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from asammdf import MDF, Signal
from axis_motion import Axis, clean
from recorded_rows import rows_of

from reconcile.errors import ReconcileError
from reconcile.formats.mapping import parse_mapping
from reconcile.formats.readers import READERS
from reconcile.recording.recording import AxisRecording, load_recordings
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.recorder import Recorder

MODEL = {"x": Axis()}
CLEAN = clean(1.0)
SCALE_M = CLEAN.scale_m if CLEAN.scale_m is not None else np.zeros(0)
CURRENT_A = CLEAN.force_n / Axis().force_constant_n_a
NAMES = "time_s,x.motor_position_m,x.motor_current_a,x.scale_position_m"


def load(path: Path, *mapping: str) -> list[AxisRecording]:
    return load_recordings([path], MODEL, parse_mapping(mapping))


def csv(path: Path, names: str, *columns: object, units: str = "", comma: bool = False) -> Path:
    lines = ["# made by a data logger", names] + ([units] if units else [])
    for row in zip(*columns, strict=True):
        text = (";" if comma else ",").join(f"{value:.10g}" for value in row)
        lines.append(text.replace(".", ",") if comma else text)
    path.write_text("\n".join(lines) + "\n")
    return path


def as_csv(directory: Path) -> list[AxisRecording]:
    return load(csv(directory / "a.csv", NAMES, CLEAN.time_s, CLEAN.motor_m, CURRENT_A, SCALE_M))


def as_csv_of_another_country(directory: Path) -> list[AxisRecording]:
    names = "Zeit;Motor;Strom;Scale_position_um"
    path = csv(
        directory / "b.csv",
        names,
        CLEAN.time_s * 1e3,
        CLEAN.motor_m * 1e3,
        CURRENT_A * 1e3,
        SCALE_M * 1e6,
        units="ms;mm;mA;µm",
        comma=True,
    )
    return load(path, "time=Zeit, position=Motor, current=Strom")


def as_parquet(directory: Path) -> list[AxisRecording]:
    units = {"time_s": "s", "motor_position": "mm", "motor_force_kn": "kN", "scale_position_m": "m"}
    values = [CLEAN.time_s, CLEAN.motor_m * 1e3, CLEAN.force_n * 1e-3, SCALE_M]
    fields = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit in units.items()]
    pq.write_table(pa.Table.from_arrays(values, schema=pa.schema(fields)), directory / "c.parquet")
    return load(directory / "c.parquet")


def as_npz(directory: Path) -> list[AxisRecording]:
    np.savez(
        directory / "d.npz",
        t_s=CLEAN.time_s,
        both=np.column_stack([CLEAN.motor_m, SCALE_M]),
        force_N=CLEAN.force_n,
        who=np.array("me"),
    )
    return load(directory / "d.npz", "time=t_s,position=both.0", "scale=both.1", "force=force_N")


def as_mat(directory: Path) -> list[AxisRecording]:
    content = {"t": CLEAN.time_s[:, None], "vir": CLEAN.force_n / 35.0, "gtau": 35.0}
    scipy.io.savemat(directory / "e.mat", {"rec": content | {"q_mm": CLEAN.motor_m * 1e3, "s_m": SCALE_M}})
    return load(
        directory / "e.mat",
        "time=rec.t,position=rec.q_mm*1e-3,scale=rec.s_m,voltage=rec.vir,force_per_volt=rec.gtau",
    )


def as_mf4(directory: Path) -> list[AxisRecording]:
    slow = slice(None, None, 10)
    with MDF(version="4.10") as content:
        for name, values, unit in (
            ("x.motor_position", CLEAN.motor_m * 1e3, "mm"),
            ("x.motor_current", CURRENT_A, "A"),
            ("x.scale_position", SCALE_M, "m"),
        ):
            content.append(Signal(values, CLEAN.time_s, name=name, unit=unit))
        content.append(Signal(20.0 + CLEAN.time_s[slow], CLEAN.time_s[slow], name="temperature", unit="degC"))
        content.save(directory / "f.mf4")
    recordings = load(directory / "f.mf4")
    warm_k = recordings[0].temperature_k
    assert warm_k is not None
    np.testing.assert_allclose(warm_k, 293.15 + np.minimum(CLEAN.time_s, 0.99), atol=1e-9)
    return recordings


def as_directory(directory: Path) -> list[AxisRecording]:
    command_m = CLEAN.reference_m if CLEAN.reference_m is not None else np.zeros(0)
    rows = np.array(
        rows_of(("x",), command_m[:, None], SCALE_M[:, None], 1e-3, motor_m=CLEAN.motor_m[:, None])
    )
    channels = channels_of(("x",))
    rows[:, [channel.name for channel in channels].index("x.motor_current_a")] = CURRENT_A
    rows[:, -1] = 0x27
    rows[:40, -1] = 0x21  # the drive is not on yet
    recorder = Recorder(directory / "r", channels, {"axes": ["x"], "finished": False})
    for row in rows:
        recorder.record(row.tolist())
    recorder.close({"axes": ["x"], "finished": True})
    return load(directory / "r")


WRITERS = [as_csv, as_csv_of_another_country, as_parquet, as_npz, as_mat, as_mf4, as_directory]


@pytest.mark.parametrize("write", WRITERS, ids=[write.__name__ for write in WRITERS])
def test_every_format_gives_the_same_recording(
    write: Callable[[Path], list[AxisRecording]], tmp_path: Path
) -> None:
    (recording,) = write(tmp_path)
    rows = slice(40 if write is as_directory else 0, None)
    assert recording.axis == "x"
    assert recording.period_s == 1e-3
    assert recording.start_s == pytest.approx(CLEAN.time_s[rows][0])
    assert recording.scale_m is not None
    np.testing.assert_allclose(recording.motor_m, CLEAN.motor_m[rows], atol=1e-11)
    np.testing.assert_allclose(recording.force_n, CLEAN.force_n[rows], atol=1e-6)
    np.testing.assert_allclose(recording.scale_m, SCALE_M[rows], atol=1e-11)
    np.testing.assert_allclose(recording.time_s, np.arange(len(recording.motor_m)) * 1e-3, atol=1e-9)
    assert recording.findings == ()


def test_several_axes_are_distinguished_by_prefix_and_refer_to_each_other(tmp_path: Path) -> None:
    names = "time_s,y.motor_position_m,y.motor_force_n,x.motor_position_mm,x.motor_force_n"
    half_m = CLEAN.motor_m / 2
    path = csv(
        tmp_path / "t.csv", names, CLEAN.time_s, half_m, CLEAN.force_n, CLEAN.motor_m * 1e3, CLEAN.force_n
    )
    x, y = load_recordings([path], {"x": Axis(), "y": Axis()})
    assert (x.axis, y.axis) == ("x", "y")
    np.testing.assert_allclose(x.others["y"], half_m, atol=1e-11)
    np.testing.assert_allclose(y.others["x"], CLEAN.motor_m, atol=1e-11)


def test_unused_columns_are_listed(tmp_path: Path) -> None:
    names = "time_s,motor_position_m,force_n,pressure_bar,motor_position"
    path = csv(tmp_path / "t.csv", names, CLEAN.time_s, *[CLEAN.motor_m] * 4)
    assert load(path)[0].ignored == ("pressure_bar", "motor_position")


def test_a_column_without_a_prefix_belongs_to_the_only_axis_of_the_model(tmp_path: Path) -> None:
    path = csv(
        tmp_path / "t.csv", "time,motor_position_m,force_n", CLEAN.time_s, CLEAN.motor_m, CLEAN.force_n
    )
    (recording,) = load_recordings([path], {"z": Axis()})
    assert recording.axis == "z"


SMALL = "time_s,motor_position_m,force_n\n0.0,0.0,1.0\n0.001,{},1.0\n0.002,0.0,1.0\n"
REFUSED = [
    (SMALL.format("bad"), (), r"row 3, column 'motor_position_m': 'bad' is not a number"),
    (SMALL.format("0,0"), (), r"rows from 2 on: cannot be read"),
    (SMALL.replace("motor_position_m", "q").format(0), (), r"axis x: has no motor position.*q.*--map"),
    (SMALL.format(0), ("position=q",), r"has no column 'q'; it has: time_s, motor_position_m, force_n"),
    (SMALL.format(0), ("position=force_n",), r"'force_n': its name ends in _n.*not a unit of a length"),
    (SMALL.replace("time_s", "when").format(0), (), r"has no time.*period=0.001"),
    (SMALL.replace("force_n", "motor_voltage_v").format(0), (), r"has a voltage.*force_per_volt"),
    (SMALL.replace("0.001", "-0.1").format(0), (), r"time, row 3: does not increase"),
    (SMALL.format(0).replace("0.001", "1").replace("0.002", "2"), (), r"sample time is 1 s.*\*1e-3"),
    (SMALL.format(0), (), r"no unbroken stretch of 0.25 s and 200 samples.*is 0.002 s, 3 samples"),
    (SMALL.format(0), (), r"record some seconds.*reversals.*two speeds"),
    (SMALL.format("nan"), (), r"are position and force valid \(not NaN\)"),
    ("1,2,3\n4,5,6\n", (), r"line 1: holds numbers where the names"),
    ("", (), r"is empty"),
]


@pytest.mark.parametrize(("text", "mapping", "reason"), REFUSED, ids=[reason for *_, reason in REFUSED])
def test_a_csv_that_cannot_be_used_is_refused_with_place_and_remedy(
    text: str, mapping: tuple[str, ...], reason: str, tmp_path: Path
) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ReconcileError, match=reason):
        load(path, *mapping)


def test_a_unit_that_contradicts_the_name_is_refused(tmp_path: Path) -> None:
    field = pa.field("motor_position_m", pa.float64(), metadata={"unit": "mm"})
    pq.write_table(pa.Table.from_arrays([[0.0]], schema=pa.schema([field])), tmp_path / "u.parquet")
    with pytest.raises(ReconcileError, match=r"its unit is 'mm', but its name ends in _m; say what is right"):
        load(tmp_path / "u.parquet")


def test_columns_of_another_length_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "l.npz", t=CLEAN.time_s, q=CLEAN.motor_m[1:], force_n=CLEAN.force_n)
    with pytest.raises(ReconcileError, match=r"column 'q': has 999 values, the time has 1000"):
        load(tmp_path / "l.npz", "position=q")


@pytest.mark.parametrize("suffix", sorted({*READERS, ".log"}))
@pytest.mark.parametrize("content", [b"", b"\x00\xff garbage \n\x93", b"PK\x03\x04 torn", b"PAR1torn"])
def test_a_damaged_file_is_refused_by_name(suffix: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"damaged{suffix}"
    path.write_bytes(content)
    with pytest.raises(ReconcileError, match=rf"damaged\{suffix}: "):
        load(path)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("speed=v", r"there is no 'speed'; there are: time, position"),
        ("position", r"not of the form ROLE=COLUMN"),
        ("position=q*fast", r"'fast' is not a number"),
        ("position=q,position=r", r"given twice"),
        ("period=-1", r"above zero"),
    ],
)
def test_a_mapping_that_cannot_be_read_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ReconcileError, match=reason):
        parse_mapping([text])
