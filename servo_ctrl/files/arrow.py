"""Parquet and CSV: pyarrow behind one file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from kernels.arrays import Array
from servo_ctrl.files.whole_file import write_whole

AnyColumns = dict[str, np.ndarray[Any, np.dtype[Any]]]
"""By name, (n,) each, of the type that the file has."""


class FileColumn(Protocol):
    """The description of a column in a file."""

    @property
    def name(self) -> str:
        """Name of the column."""

    @property
    def unit(self) -> str:
        """Unit, "1" without one."""

    @property
    def dtype(self) -> str:
        """Numpy type name."""

    @property
    def meaning(self) -> str:
        """Its content, in words."""


def write_part(path: Path, channels: Sequence[FileColumn], rows: Array) -> None:
    """Write rows (n, channels) as one Parquet file; each field carries unit and meaning. Raises OSError."""
    fields = [
        pa.field(
            channel.name,
            pa.from_numpy_dtype(np.dtype(channel.dtype)),
            metadata={"unit": channel.unit, "meaning": channel.meaning},
        )
        for channel in channels
    ]
    columns = [_column(rows[:, i].astype(channel.dtype)) for i, channel in enumerate(channels)]
    table = pa.Table.from_arrays(columns, schema=pa.schema(fields))
    write_whole(path, lambda temporary: pq.write_table(table, temporary))


def _column(values: np.ndarray[Any, np.dtype[Any]]) -> Any:
    """Return numbers (n,) without a copy; `pa.array` would load pandas to look for its series."""
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def read_parts(paths: Sequence[Path]) -> AnyColumns:
    """Return the columns of all parts, joined in order. Raises OSError and ValueError (not Parquet)."""
    try:
        table = pa.concat_tables([pq.read_table(path) for path in paths])
    except (OSError, ValueError):
        raise
    except Exception as error:  # Arrow raises whatever a broken file leads to
        raise ValueError(str(error) or repr(error)) from error
    return {name: table.column(name).to_numpy() for name in table.column_names}


def write_csv(path: Path, columns: AnyColumns) -> None:
    """Write columns with one header line; a missing value (NaN) is written as nan. Raises OSError."""
    table = pa.table(columns)
    write_whole(path, lambda temporary: pa.csv.write_csv(table, temporary))


class PartsExtent(NamedTuple):
    """Contents of Parquet files by their footers, without reading rows."""

    rows: int
    extremes: dict[str, tuple[float, float]]
    """Least and greatest value by column; a column without any is missing. NaN does not count."""


def parts_extent(paths: Sequence[Path], names: Sequence[str]) -> PartsExtent:
    """Return the rows of all files and the extremes of these columns. Raises OSError and ValueError."""
    rows, extremes = 0, dict[str, tuple[float, float]]()
    try:
        for path in paths:
            footer = pq.read_metadata(path)
            rows += footer.num_rows
            for group in range(footer.num_row_groups):
                chunks = (footer.row_group(group).column(place) for place in range(footer.num_columns))
                for chunk in chunks:
                    statistics = chunk.statistics if chunk.path_in_schema in names else None
                    if statistics is not None and statistics.has_min_max:
                        low, high = extremes.get(chunk.path_in_schema, (statistics.min, statistics.max))
                        extremes[chunk.path_in_schema] = (min(low, statistics.min), max(high, statistics.max))
    except (OSError, ValueError):
        raise
    except Exception as error:  # Arrow raises whatever a broken file leads to
        raise ValueError(str(error) or repr(error)) from error
    return PartsExtent(rows, extremes)


def read_named(paths: Sequence[Path], names: Sequence[str]) -> AnyColumns:
    """Read the columns `names` of Parquet files, joined. Raises KeyError for a missing one."""
    missing = [name for name in names if name not in pq.read_schema(paths[0]).names]
    if missing:
        raise KeyError(missing[0])
    table = pa.concat_tables([pq.read_table(path, columns=list(names)) for path in paths])
    return {name: table[name].to_numpy() for name in names}
