"""ASAM MDF (.mf4, .mdf, .dat) through asammdf, which comes with the extra `mdf4`.

Channels of an MDF may have different time bases. The rows are those of the time base with the most samples; a
channel of another time base is interpolated linearly between its samples, and not extrapolated.
"""

from pathlib import Path
from typing import Any

import numpy as np

from kernels.arrays import Array
from reconcile.errors import ReconcileError, in_words
from reconcile.formats.table import Column, Table


def read(path: Path) -> Table:
    """Read all channels of numbers, with `time` in seconds. Raises ReconcileError."""
    try:
        from asammdf import MDF  # noqa: PLC0415 two seconds of import, and an extra
    except ImportError as error:
        raise ReconcileError(
            path, "", "MDF4 needs asammdf, which is not installed", "pip install 'servo-ctrl[mdf4]'"
        ) from error
    try:
        with MDF(path) as content:
            signals = list(content.iter_channels(skip_master=True))
    except Exception as error:  # asammdf raises whatever a broken file leads to
        raise ReconcileError(path, "", f"is not a readable MDF file: {in_words(error)}") from error
    return _table(path, signals)


def _table(path: Path, signals: list[Any]) -> Table:
    usable = [s for s in signals if s.samples.ndim == 1 and s.samples.dtype.kind in "fiub" and len(s.samples)]
    if not usable:
        raise ReconcileError(path, "", "holds no channel of numbers")
    longest = max(usable, key=lambda signal: len(signal.samples))
    time_s = np.asarray(longest.timestamps, dtype=np.float64)
    columns = {"time": Column(time_s, "s")}
    ignored = [signal.name for signal in signals if signal not in usable]
    for signal in usable:
        if signal.name in columns:
            ignored.append(f"{signal.name} (a second one)")
        else:
            columns[signal.name] = Column(_interpolated(time_s, signal), signal.unit or "")
    return Table(str(path), columns, ignored=tuple(ignored))


def _interpolated(time_s: Array, signal: Any) -> Array:
    samples = np.asarray(signal.samples, dtype=np.float64)
    own_s = np.asarray(signal.timestamps, dtype=np.float64)
    if len(own_s) == len(time_s) and np.array_equal(own_s, time_s):
        return samples
    return np.interp(time_s, own_s, samples, left=np.nan, right=np.nan)
