"""Named columns of numbers from an npz, csv or parquet file, or from the parquet parts of a recording."""

import csv
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from kernels.arrays import Array
from servo_ctrl.errors import ConfigError, first_line

Columns = dict[str, Array]


def read_columns(path: Path, names: Sequence[str]) -> Columns:
    """Read the columns `names`, each (n,) finite float64. Raises ConfigError."""
    if not path.exists():
        raise ConfigError(path, "", "no such file")
    reader = _READERS.get("directory" if path.is_dir() else path.suffix)
    if reader is None:
        raise ConfigError(path, "", "is none of .npz, .csv, .parquet and no recording")
    try:
        columns = reader(path, names)
    except KeyError as error:
        raise ConfigError(path, str(error.args[0]), "there is no such column") from None
    except Exception as error:  # noqa: BLE001  # the libraries raise whatever a broken file leads to
        raise ConfigError(path, "", f"cannot be read: {first_line(error)}") from None
    count = len(np.atleast_1d(columns[names[0]]))
    for name, values in columns.items():
        if values.shape != (count,):
            raise ConfigError(path, name, f"is not a column of {count} numbers like {names[0]}")
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values)))
            raise ConfigError(path, name, f"is not finite in row {row + 1}")
    return columns


def _read_npz(path: Path, names: Sequence[str]) -> Columns:
    with np.load(path, allow_pickle=False) as archive:
        missing = [name for name in names if name not in archive.files]
        if missing:
            raise KeyError(missing[0])
        return {name: np.asarray(archive[name], dtype=np.float64) for name in names}


def _read_csv(path: Path, names: Sequence[str]) -> Columns:
    with path.open(encoding="utf-8", newline="") as stream:
        header = next(csv.reader(stream), [])
        missing = [name for name in names if name not in header]
        if missing:
            raise KeyError(missing[0])
        selected = [header.index(name) for name in names]
        table = np.loadtxt(stream, delimiter=",", usecols=selected, ndmin=2, dtype=np.float64)
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def _read_parquet(path: Path, names: Sequence[str]) -> Columns:
    from servo_ctrl.files.arrow import read_named  # noqa: PLC0415  # 30 MB that few programs need

    parts = sorted(path.glob("part-*.parquet")) if path.is_dir() else [path]
    if not parts:
        raise ValueError("the recording has no rows (no part-*.parquet)")
    return {name: values.astype(np.float64) for name, values in read_named(parts, names).items()}


_READERS: dict[str, Callable[[Path, Sequence[str]], Columns]] = {
    ".npz": _read_npz,
    ".csv": _read_csv,
    ".parquet": _read_parquet,
    "directory": _read_parquet,
}
