"""CSV as instruments write it: lines of a preamble, names, perhaps units, rows; comma, semicolon or tab.

The names are the last line of words above the first row of numbers, or the one above their units. After
semicolons and tabs a decimal comma is understood.
"""

from pathlib import Path
from typing import NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.arrow_files import parse_csv
from reconcile.formats.quantities import is_unit
from reconcile.formats.table import Column, Table

DELIMITERS = ("\t", ";", ",")
LONGEST_PREAMBLE = 500
"""Lines among which the names are sought; chosen: instruments write some tens."""
EMPTY_CELLS = ("", "nan", "null", "na", "n/a", "-", "inf", "-inf")
"""Cells of a row that hold no value."""
BYTE_ORDER_MARKS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


class _Heading(NamedTuple):
    """What stands above the rows; lines count from 0."""

    delimiter: str
    line: int
    """Of the names."""
    names: list[str]
    units: list[str] | None
    first_row: int


def read(path: Path) -> Table:
    """Read all columns; one that holds anything but numbers as text. Raises ReconcileError naming the row."""
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
    """The content in UTF-8, without a byte order mark; what is no Unicode is taken for Latin-1."""
    for mark, encoding in BYTE_ORDER_MARKS.items():
        if content.startswith(mark):
            return content[len(mark) :].decode(encoding, "replace").encode()
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("latin-1").encode()
    return content


def _first_lines(content: bytes) -> tuple[list[str], list[int]]:
    """The lines in which the names may stand, and where each starts; the end of the content as the last."""
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
    # some write the names as a comment, which counts where nothing else stands above the rows
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
    """The lines that hold values, of the most frequent number of cells; the delimiter; that number."""
    counts: dict[int, list[int]] = {}
    for number in filled:
        cells = _cells(lines[number], delimiter)
        if len(cells) > 1 and _is_row(cells):
            counts.setdefault(len(cells), []).append(number)
    count = max(counts, key=lambda cells: (len(counts[cells]), cells), default=0)
    return counts.get(count, []), delimiter, count


def _is_row(cells: list[str]) -> bool:
    """Whether a line holds values: a number, and few words (a state, a time of day) beside numbers."""
    numbers = sum(_is_number(cell) for cell in cells)
    words = sum(not _is_number(cell) and cell.lower() not in EMPTY_CELLS for cell in cells)
    return numbers > 0 and numbers >= words


def _are_units(cells: list[str]) -> bool:
    """Whether a line below the names holds their units: any known one, and no longer words."""
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
