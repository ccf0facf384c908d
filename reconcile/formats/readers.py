"""Choice of the reader of a recording, by the suffix of its file."""

from collections.abc import Callable
from collections.abc import Mapping as ByName
from functools import partial
from pathlib import Path

from reconcile.errors import ReconcileError
from reconcile.formats import (
    candump_log,
    csv_file,
    mat_file,
    mdf4_file,
    npz_file,
    parquet_file,
    recording_directory,
)
from reconcile.formats.mapping import Mapping
from reconcile.formats.model_axis import ModelAxis
from reconcile.formats.table import Table

READERS: dict[str, Callable[[Path], Table]] = {
    ".parquet": parquet_file.read,
    ".csv": csv_file.read,
    ".tsv": csv_file.read,
    ".npz": npz_file.read,
    ".mat": mat_file.read,
    ".mf4": mdf4_file.read,
    ".mdf": mdf4_file.read,
    ".dat": mdf4_file.read,
}
CANDUMP = ".log"


def read_table(path: Path, mapping: Mapping, model: ByName[str, ModelAxis]) -> Table:
    """Read the columns of a recording of any format. Raises ReconcileError."""
    if path.is_dir():
        return recording_directory.read(path)
    suffix = path.suffix.lower()
    readers = READERS | {CANDUMP: partial(candump_log.read, mapping=mapping, model=model)}
    if not path.exists():
        raise ReconcileError(path, "", "there is no such file or directory")
    if suffix not in readers:
        known = ", ".join(sorted(readers))
        raise ReconcileError(path, "", f"{suffix or 'no suffix'} is no known format", f"known are: {known}")
    return readers[suffix](path)
