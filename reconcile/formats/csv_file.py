"""CSV: one line of names, optionally one of units; comma, semicolon or tab; `#` lines before are skipped.

After semicolons and tabs a decimal comma is understood.
"""

import io
from pathlib import Path

from reconcile.errors import ReconcileError
from reconcile.formats.arrow_files import parse_csv
from reconcile.formats.table import Column, Table

DELIMITERS = ("\t", ";", ",")


def read(path: Path) -> Table:
    """Read all columns; one that holds anything but numbers as text. Raises ReconcileError naming the row."""
    try:
        text = path.read_bytes().decode("utf-8-sig", "replace")
    except OSError as error:
        raise ReconcileError(path, "", error.strerror or "cannot be read") from error
    skipped = 0
    lines = io.StringIO(text)
    while (header := lines.readline()).startswith("#") or (header and not header.strip()):
        skipped += 1
    if not header:
        raise ReconcileError(path, "", "is empty")
    delimiter = next((mark for mark in DELIMITERS if mark in header), None)
    if delimiter is None:
        raise ReconcileError(path, f"line {skipped + 1}", "has no two names that a , ; or tab divides")
    names = _cells(header, delimiter)
    _check_names(path, names, skipped + 1)
    here = lines.tell()
    units = _units(lines.readline(), delimiter, len(names))
    if units is None:
        lines.seek(here)
    body = lines.read()
    if not body.strip():
        raise ReconcileError(path, "", "has no rows below its names")
    if delimiter != "," and "." not in body:
        body = body.replace(",", ".")
    first_row = skipped + (3 if units else 2)
    table = parse_csv(path, body, names, delimiter, first_row)
    if units is None:
        return table
    unit_of = dict(zip(names, units, strict=True))
    columns = {name: Column(column.values, unit_of[name]) for name, column in table.columns.items()}
    return table._replace(columns=columns)


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.rstrip("\r\n").split(delimiter)]


def _check_names(path: Path, names: list[str], line: int) -> None:
    for name in names:
        if not name:
            raise ReconcileError(path, f"line {line}", "a column has no name")
        if names.count(name) > 1:
            raise ReconcileError(path, f"line {line}", f"the name {name!r} stands twice")
    if all(_is_number(name) for name in names):
        raise ReconcileError(path, f"line {line}", "holds numbers where the names of the columns must be")


def _units(line: str, delimiter: str, count: int) -> list[str] | None:
    """The cells of a line of units; None where the line holds a number or is shorter."""
    cells = _cells(line, delimiter)
    if len(cells) != count or not any(cells):
        return None
    return None if any(_is_number(cell) or cell.lower() in {"nan", "null"} for cell in cells) else cells


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
