"""Fuzz targets: recordings of every format that `reconcile` and the controller read."""

import functools
import io
import struct
import warnings
from collections.abc import Sequence

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
from asammdf.blocks.mdf_v4 import MDF4
from synthetic_recording import circle, write_recording

from reconcile.errors import ReconcileError
from reconcile.formats.mapping import parse_mapping
from reconcile.nominal_model.model_file import NominalModel, load_model
from reconcile.recording.recording import load_recordings
from servo_ctrl.errors import ConfigError
from servo_ctrl.files.columns import read_columns
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import HEADER_FILE, RecordingError
from tests.campaigns.hostile.targets import GOLDEN, file_with, folder, target

HEADER_END = b"\n--\n"
ROWS = 400
MAPPING = parse_mapping(("position=position", "force=force"))


@functools.cache
def model() -> NominalModel:
    """Return the model of one axis x."""
    return load_model(GOLDEN / "diagnosis" / "model.toml")


@functools.cache
def bus_model() -> NominalModel:
    """Return the X-Y table with its nodes; their EDS files, read for each input, have only TPDO objects."""
    wanted = ("1000", "1018", "1800", "1A00", "6004", "6041", "6064", "6078")
    for name in ("servo_drive.eds", "linear_scale.eds"):
        sections = (GOLDEN / "eds" / name).read_text(encoding="utf-8").split("\n[")
        kept = [text for text in sections[1:] if text.upper().startswith(wanted)]
        file_with("\n".join([sections[0], *(f"[{text}" for text in kept)]).encode(), f"small/{name}")
    text = (GOLDEN / "machines" / "xy_table" / "plant.toml").read_text(encoding="utf-8")
    return load_model(file_with(text.replace("../../eds/", "").encode(), "small/plant.toml"))


@functools.cache
def _columns() -> dict[str, np.ndarray]:
    """Return a valid recording: half a second of a sine."""
    time_s = np.arange(ROWS) * 2e-3
    position = 0.02 * np.sin(2.0 * np.pi * 2.0 * time_s)
    return {"time": time_s, "position": position, "force": 20.0 * np.cos(2.0 * np.pi * 2.0 * time_s)}


def _read(data: bytes, name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a reader's library may warn of what it repairs
        load_recordings([file_with(data, name)], model().axes, MAPPING)


def _csv() -> Sequence[bytes]:
    lines = [",".join(_columns()), "s,m,N"]
    lines += [",".join(f"{value:.9g}" for value in row) for row in zip(*_columns().values(), strict=True)]
    text = "\n".join(lines)
    return [text.encode(), text.replace(",", ";").replace(".", ",").encode()]


@target(
    "reconcile.formats.csv_file",
    _csv,
    declared=ReconcileError,
    words=(b"nan", b",,", b";", b"\t", b"#", b'"', b"1,5", b"\xef\xbb\xbf", b"time", b"mm/s", b"1970-01-01"),
    short=100,
)
def csv(data: bytes) -> None:
    _read(data, "run.csv")


def _parquet() -> Sequence[bytes]:
    file = io.BytesIO()
    pq.write_table(pa.table(_columns()), file, compression="none")
    packed = io.BytesIO()
    pq.write_table(pa.table(_columns()), packed)
    return [file.getvalue(), packed.getvalue()]


@target("reconcile.formats.arrow_files", _parquet, declared=ReconcileError, words=(b"PAR1",), short=150)
def parquet(data: bytes) -> None:
    _read(data, "run.parquet")


def _npz() -> Sequence[bytes]:
    file, packed = io.BytesIO(), io.BytesIO()
    np.savez(file, **_columns())
    np.savez_compressed(packed, **_columns())
    return [file.getvalue(), packed.getvalue()]


@target(
    "reconcile.formats.array_files",
    _npz,
    declared=ReconcileError,
    words=(b"PK\x03\x04", b"'shape': (", b"'|O'", b"'<f8'", b"99999999999,", b"True"),
    short=150,
)
def npz(data: bytes) -> None:
    _read(data, "run.npz")


def _mat() -> Sequence[bytes]:
    files = []
    for options in ({}, {"do_compression": True}, {"format": "4"}):
        file = io.BytesIO()
        scipy.io.savemat(file, _columns(), **options)
        files.append(file.getvalue())
    return files


@target("reconcile.formats.array_files", _mat, declared=ReconcileError, words=(b"MATLAB 7.3 MAT",), short=150)
def mat(data: bytes) -> None:
    _read(data, "run.mat")


def _mf4() -> Sequence[bytes]:
    from asammdf import MDF, Signal  # noqa: PLC0415  # two seconds of import

    columns = _columns()
    signals = [Signal(columns[name], columns["time"], name=name) for name in ("position", "force")]
    with MDF(version="4.10") as file:
        file.append(signals)
        path = file.save(folder() / "seed.mf4", overwrite=True)
    return [path.read_bytes()]


@target(
    "reconcile.formats.mdf4_file", _mf4, declared=ReconcileError, words=(b"##DG", b"##CN", b"##HD"), short=60
)
def mf4(data: bytes) -> None:
    MDF4.__del__ = lambda _half: None  # it complains of objects that were never whole
    _read(data, "run.mf4")


def _of_a_step() -> Sequence[bytes]:
    return [b".csv" + _csv()[0].replace(b"s,m,N\n", b""), b".npz" + _npz()[0], b".parquet" + _parquet()[0]]


@target("servo_ctrl.files.columns", _of_a_step, declared=ConfigError, words=(b"nan", b'"', b"\0"), short=150)
def columns_of_a_step(data: bytes) -> None:
    """Read the set points of a program's step; the input begins with the file's suffix."""
    ending = next((one for one in (".csv", ".npz", ".parquet") if data.startswith(one.encode())), ".csv")
    columns = read_columns(file_with(data.removeprefix(ending.encode()), f"step{ending}"), list(_columns()))
    assert all(np.isfinite(column).all() for column in columns.values())


def _candump() -> Sequence[bytes]:
    downloads = (
        "2300180181010080",
        "2f001a0000000000",
        "23001a0110004160",
        "23001a0220006460",
        "23001a0310007860",
    )
    downloads += ("2f001a0003000000", "2300180181010000")
    lines = [b"(0.000000) can0 601#" + download.encode() for download in downloads]
    for number, position in enumerate(_columns()["position"]):
        inputs = struct.pack("<Hih", 0x1237, round(4e6 * position), 100)
        stamp = b"(%.6f) can0 " % (number * 2e-3)
        lines += [stamp + b"080#", stamp + b"181#" + inputs.hex().encode()]
    return [b"\n".join(lines) + b"\n"]


@target(
    "reconcile.formats.candump_log",
    _candump,
    declared=ReconcileError,
    words=(b"(0.1) can0 080#", b"(9e9) vcan0 181#R", b"601#23001A0108000000", b"##1", b"#"),
    short=100,
)
def candump(data: bytes) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        load_recordings([file_with(data, "run.log")], {"x": bus_model().axes["x"]})


def _recording() -> Sequence[bytes]:
    place = GOLDEN / "recording"
    return [(place / HEADER_FILE).read_bytes() + HEADER_END + (place / "part-00000.parquet").read_bytes()]


def _split(data: bytes) -> None:
    header, _, part = data.partition(HEADER_END)
    file_with(header, f"recording/{HEADER_FILE}")
    file_with(part, "recording/part-00000.parquet")


@target("servo_ctrl.recording.reader", _recording, declared=RecordingError, words=(b"null", b"[]"), short=150)
def recording_directory(data: bytes) -> None:
    _split(data)
    recording = load_recording(folder() / "recording")
    assert len({len(column) for column in recording.columns.values()}) <= 1
    assert isinstance(recording.axes, tuple)


def _longer_recording() -> Sequence[bytes]:
    place = write_recording(folder() / "seed", circle(lambda angle: 0.0 * angle, turns=0.4))
    return [(place / HEADER_FILE).read_bytes() + HEADER_END + (place / "part-00000.parquet").read_bytes()]


@target("reconcile.formats.readers", _longer_recording, declared=ReconcileError, short=100)
def recording_in_reconcile(data: bytes) -> None:
    _split(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numbers without bounds overflow
        load_recordings([folder() / "recording"], bus_model().axes)


@target(
    "reconcile.formats.mapping", lambda: [b"position=a b\nforce=c:mm\nperiod=0.001"], declared=ReconcileError
)
def mapping(data: bytes) -> None:
    parse_mapping(data.decode("utf-8", "replace").splitlines())
