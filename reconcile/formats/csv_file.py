"""CSV: one line of names, optionally one of units; comma, semicolon or tab; `#` lines before are skipped.

After semicolons and tabs a decimal comma is understood.
"""

import io
from pathlib import Path

import pyarrow as pa
import pyarrow.csv

from reconcile.errors import ReconcileError
from reconcile.formats.arrow_columns import table_of
from reconcile.formats.table import Column, Table
from servo_ctrl.errors import first_line

DELIMITERS = ("\t", ";", ",")
MISSING = ["", "nan", "NaN", "NAN", "null", "NULL", "NA", "n/a", "-", "inf", "-inf"]


def read(path: Path) -> Table:
    """All columns; one that holds anything but numbers as text. Raises ReconcileError naming the row."""
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
    names = [name.strip().strip('"').strip() for name in header.rstrip("\r\n").split(delimiter)]
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
    table = table_of(str(path), _parsed(path, body, names, delimiter, first_row), first_row)
    if units is None:
        return table
    unit_of = dict(zip(names, units, strict=True))
    columns = {name: Column(column.values, unit_of[name]) for name, column in table.columns.items()}
    return table._replace(columns=columns)


def _parsed(path: Path, body: str, names: list[str], delimiter: str, first_row: int) -> pa.Table:
    try:
        return pa.csv.read_csv(
            io.BytesIO(body.encode()),
            read_options=pa.csv.ReadOptions(column_names=names, use_threads=False),
            parse_options=pa.csv.ParseOptions(delimiter=delimiter),
            convert_options=pa.csv.ConvertOptions(null_values=MISSING, strings_can_be_null=True),
        )
    except pa.ArrowException as error:
        where = f"rows from {first_row} on"
        raise ReconcileError(path, where, f"cannot be read: {first_line(error)}") from error


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
    cells = [cell.strip().strip('"').strip() for cell in line.rstrip("\r\n").split(delimiter)]
    if len(cells) != count or not any(cells):
        return None
    return None if any(_is_number(cell) or cell.lower() in {"nan", "null"} for cell in cells) else cells


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
