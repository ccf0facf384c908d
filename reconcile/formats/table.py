"""What every format is read into: columns of one length, as they stand in the file."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class Column(NamedTuple):
    """One channel. `unit` is what the file itself says, empty where it says nothing."""

    values: Array
    unit: str = ""


class Table(NamedTuple):
    """The numbers of one file. `first_row` is the number that its first row has in a text editor."""

    source: str
    columns: dict[str, Column]
    text_columns: dict[str, list[str]] = {}  # noqa: RUF012 never written to
    """Columns that are no numbers, for the message that says so."""
    first_row: int = 0
    ignored: tuple[str, ...] = ()
    """Names that the format left out by itself."""

    def row(self, index: int) -> str:
        """Where a sample is, for messages."""
        return f"row {index + self.first_row}"


def short_list(names: Iterable[str], most: int = 12) -> str:
    """Names for a message, not all of hundreds."""
    known = list(names)
    rest = len(known) - most
    return ", ".join(known[:most]) + (f" and {rest} more" if rest > 0 else "") if known else "none"
