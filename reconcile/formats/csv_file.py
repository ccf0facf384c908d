"""CSV of instruments: a preamble, names, perhaps units, rows; delimited by comma, semicolon or tab.

The names are in the last line of words above the first row of numbers, or in the line above their units.
Between semicolons and tabs a decimal comma is accepted.
"""

from pathlib import Path
from typing import NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.arrow_files import parse_csv
from reconcile.formats.quantities import is_unit
from reconcile.formats.table import Column, Table

DELIMITERS = ("\t", ";", ",")
LONGEST_PREAMBLE = 500
"""Lines searched for the names; chosen: instruments write some tens."""
EMPTY_CELLS = ("", "nan", "null", "na", "n/a", "-", "inf", "-inf")
"""Cells of a row that hold no value."""
BYTE_ORDER_MARKS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


class _Heading(NamedTuple):
    """The lines above the rows; lines count from 0."""

    delimiter: str
    line: int
    """Line of the names."""
    names: list[str]
    units: list[str] | None
    first_row: int


def read(path: Path) -> Table:
    """Read all columns, those with anything but numbers as text. Raises ReconcileError naming the row."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ReconcileError(path, "", error.strerror or "cannot be read") from error
    content = _utf8(content)
    lines, starts = _first_lines(content)
    if not any(line.strip() for line in lines):
        raise ReconcileError(path, "", "is empty")
    heading = _heading(path, lines)
    body = memoryview(content)[starts[heading.first_row] :]
    comma = heading.delimiter != "," and content.find(b".", starts[heading.first_row]) < 0
    table = parse_csv(
        path, body, heading.names, heading.delimiter, heading.first_row + 1, decimal="," if comma else "."
    )
    if heading.units is None:
        return table
    unit_of = dict(zip(heading.names, heading.units, strict=True))
    columns = {
        name: Column(column.values, column.unit or unit_of[name]) for name, column in table.columns.items()
    }
    return table._replace(columns=columns)


def _utf8(content: bytes) -> bytes:
    """Return the content in UTF-8 without a byte order mark; bytes that are not Unicode count as Latin-1."""
    for mark, encoding in BYTE_ORDER_MARKS.items():
        if content.startswith(mark):
            return content[len(mark) :].decode(encoding, "replace").encode()
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("latin-1").encode()
    return content


def _first_lines(content: bytes) -> tuple[list[str], list[int]]:
    """Return the lines searched for the names, and the offsets at which they start and the last one ends."""
    lines: list[str] = []
    starts, start = [0], 0
    while start < len(content) and len(lines) < LONGEST_PREAMBLE:
        end = content.find(b"\n", start)
        end = len(content) if end < 0 else end + 1
        lines.append(content[start:end].decode("utf-8", "replace"))
        starts.append(end)
        start = end
    return lines, starts


def _heading(path: Path, lines: list[str]) -> _Heading:
    """Find the first row of numbers, and the names above it. Raises ReconcileError."""
    filled = [number for number, line in enumerate(lines) if line.strip() and not line.startswith("#")]
    tables = [_rows(lines, filled, delimiter) for delimiter in DELIMITERS]
    rows, delimiter, count = max(tables, key=lambda table: len(table[0]))
    if not rows:
        line = filled[0] if filled else 0
        if any(mark in lines[line] for mark in DELIMITERS):
            raise ReconcileError(path, "", "has no rows below its names")
        raise ReconcileError(path, f"line {line + 1}", "has no two names that a , ; or tab divides")
    # some instruments write the names as a comment: used where nothing else is above the rows
    above = [n for n in filled if n < rows[0]] or [n for n in range(rows[0]) if lines[n].strip()]
    heads = [(number, _cells(lines[number].lstrip("# "), delimiter)) for number in above[-2:]]
    if not heads:
        raise ReconcileError(path, "line 1", "holds numbers where the names of the columns must be")
    if len(heads[-1][1]) != count:
        reason = f"has {len(heads[-1][1])} names, the rows below it have {count} values"
        raise ReconcileError(path, f"line {heads[-1][0] + 1}", reason)
    units = None
    if len(heads) == 2 and len(heads[0][1]) == count and (len(above) == 2 or _are_units(heads[1][1])):
        units = heads[1][1]
    line, names = heads[0 if units else -1]
    names = [*names[:-1], names[-1] or f"column {count}"]  # a delimiter may end each line
    _check_names(path, names, line + 1)
    return _Heading(delimiter, line, names, units, rows[0])


def _rows(lines: list[str], filled: list[int], delimiter: str) -> tuple[list[int], str, int]:
    """Return the lines of values with the most frequent number of cells, the delimiter, and that number."""
    counts: dict[int, list[int]] = {}
    for number in filled:
        cells = _cells(lines[number], delimiter)
        if len(cells) > 1 and _is_row(cells):
            counts.setdefault(len(cells), []).append(number)
    count = max(counts, key=lambda cells: (len(counts[cells]), cells), default=0)
    return counts.get(count, []), delimiter, count


def _is_row(cells: list[str]) -> bool:
    """Return whether a line holds values: a number, and no more words (state, time of day) than numbers."""
    numbers = sum(_is_number(cell) for cell in cells)
    words = sum(not _is_number(cell) and cell.lower() not in EMPTY_CELLS for cell in cells)
    return numbers > 0 and numbers >= words


def _are_units(cells: list[str]) -> bool:
    """Return whether a line below the names holds their units: a known one, and only short words."""
    return any(is_unit(cell) for cell in cells) and all(len(cell) <= 12 for cell in cells)


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.rstrip("\r\n").split(delimiter)]


def _check_names(path: Path, names: list[str], line: int) -> None:
    for name in names:
        if not name:
            raise ReconcileError(path, f"line {line}", "a column has no name")
        if names.count(name) > 1:
            raise ReconcileError(path, f"line {line}", f"the name {name!r} stands twice")


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
