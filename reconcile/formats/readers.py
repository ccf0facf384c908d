"""Reads a recording of any format: a file by its suffix, or the directory of `servo-ctrl run --record`."""

from collections.abc import Callable
from collections.abc import Mapping as ByName
from pathlib import Path

import numpy as np

from reconcile.errors import ReconcileError
from reconcile.formats import array_files, arrow_files, candump_log, csv_file, json_file, mdf4_file
from reconcile.formats.mapping import Mapping
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.formats.table import Column, Table
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import RecordingError

READERS: dict[str, Callable[[Path], Table]] = {
    ".parquet": arrow_files.read_parquet,
    ".csv": csv_file.read,
    ".tsv": csv_file.read,
    ".json": json_file.read,
    ".jsonl": json_file.read,
    ".ndjson": json_file.read,
    ".npz": array_files.read_npz,
    ".mat": array_files.read_mat,
    ".mf4": mdf4_file.read,
    ".mdf": mdf4_file.read,
    ".dat": mdf4_file.read,
}
CANDUMP = ".log"


def read_table(path: Path, mapping: Mapping, model: ByName[str, NominalAxis]) -> Table:
    """Read the columns of a recording of any format. Raises ReconcileError."""
    suffix = path.suffix.lower()
    if path.is_dir():
        return read_directory(path)
    if not path.exists():
        raise ReconcileError(path, "", "there is no such file or directory")
    if suffix == CANDUMP:
        return candump_log.read(path, mapping, model)
    if suffix not in READERS:
        known = ", ".join(sorted({*READERS, CANDUMP}))
        raise ReconcileError(
            path, "", f"{suffix or 'no suffix'} is not a known format", f"known are: {known}"
        )
    return READERS[suffix](path)


def read_directory(path: Path) -> Table:
    """Read all columns of a recorded directory, with their units. Raises ReconcileError."""
    try:
        recording = load_recording(path)
        channels = recording.header.get("channels", {}).items()
        units = {name: str(channel["unit"]) for name, channel in channels}
        modes = {name: str(mode) for name, mode in recording.header.get("modes", {}).items()}
    except RecordingError as error:
        raise ReconcileError(path, "", str(error).removeprefix(f"{path}: ")) from error
    except (KeyError, TypeError, AttributeError) as error:
        raise ReconcileError(path, "recording.json", f"is not the header of a recording: {error}") from error
    columns = {
        name: Column(values.astype(np.float64), units.get(name, ""))
        for name, values in recording.columns.items()
    }
    return Table(str(path), columns, modes=modes)
