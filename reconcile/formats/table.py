"""The table into which every format is read: columns as they are in the file."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from kernels.arrays import Array


class Column(NamedTuple):
    """One channel. `unit` is that of the file, empty without one."""

    values: Array
    unit: str = ""


class Table(NamedTuple):
    """The columns of one file. `first_row` is the line number of its first row in a text editor."""

    source: str
    columns: dict[str, Column]
    text_columns: dict[str, list[str]] = {}  # noqa: RUF012 never written to
    """Columns with other contents than numbers, for error messages."""
    first_row: int = 0
    ignored: tuple[str, ...] = ()
    """Names that the format could not convert to columns."""
    skipped: str = ""
    """Which other contents of the file were not used, as text."""
    modes: Mapping[str, str] = {}
    """Axis -> the mode in which its drive was led (`csp`, `csv`, `cst`), where the file says so."""

    def row(self, index: int) -> str:
        """Return the row of a sample, for messages."""
        return f"row {index + self.first_row}"


def short_list(names: Iterable[str], most: int = 12) -> str:
    """Join names for a message, at most `most` of them."""
    all_names = list(names)
    omitted = len(all_names) - most
    return (", ".join(all_names[:most]) or "none") + (f" and {omitted} more" if omitted > 0 else "")
