"""JSON: columns by name, or records, also nested (an axis, `data`, `values` with `unit`).

Accepted are {"t": [..], "q": [..]}, {"x": {"q": {"values": [..], "unit": "mm"}}}, [{"t": 0, "q": 1}, ..],
one record per line (.jsonl), rows below a list of names, and the form of pandas ("columns" and "data").
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kernels.arrays import Array
from reconcile.errors import ReconcileError, in_words
from reconcile.formats.table import Column, Table

VALUES = ("values", "data", "samples")
"""Keys of the list of values in a column that has a unit too."""
WRAPPERS = ("data", "samples", "records", "rows", "columns", "channels", "signals", "recording")
"""Keys around all columns or records, which are not part of the name of a column."""


def read(path: Path) -> Table:
    """Read all columns of numbers; others as text. Raises ReconcileError."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        content = _loaded(text)
    except OSError as error:
        raise ReconcileError(path, "", error.strerror or "cannot be read") from error
    except (ValueError, RecursionError) as error:
        raise ReconcileError(path, "", f"is not a readable JSON file: {in_words(error)}") from error
    columns: dict[str, Column] = {}
    words: dict[str, list[str]] = {}
    ignored: list[str] = []
    for name, values, unit in _columns(content, ""):
        if not values or any(isinstance(value, dict | list) for value in values):
            ignored.append(name)
        elif all(value is None or isinstance(value, int | float) for value in values):
            columns[name] = Column(_numbers(path, name, values), unit)
        else:
            words[name] = [str(value) for value in values]
    if not columns:
        remedy = 'columns {"t": [..], "q": [..]} or records [{"t": 0, "q": 0}, ..] are understood'
        raise ReconcileError(path, "", "holds no columns of numbers", remedy)
    return Table(str(path), columns, words, ignored=tuple(ignored))


def _numbers(path: Path, name: str, values: Sequence[float | None]) -> Array:
    try:
        return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    except OverflowError as error:
        raise ReconcileError(path, f"column {name!r}", f"holds no usable number: {error}") from None


def _loaded(text: str) -> Any:
    """Return the content; of a file with one record per line the list of records."""
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) < 2:
            raise
        return [json.loads(line) for line in lines]


def _columns(content: Any, name: str) -> Iterator[tuple[str, Sequence[Any], str]]:
    """Yield name, values and unit of each column; a single number is a column of one value."""
    if isinstance(content, dict):
        yield from _of_object(content, name)
    elif _is_plain(content):
        yield name, content, ""
    elif isinstance(content, list) and all(isinstance(row, dict) for row in content):
        yield from _of_records(content, name)
    elif isinstance(content, list) and _are_names(content[0]):
        for place, key in enumerate(content[0]):
            yield _joined(name, key), [row[place] if place < len(row) else None for row in content[1:]], ""
    elif isinstance(content, int | float):
        yield name, [content], ""


def _of_object(content: Mapping[str, Any], name: str) -> Iterator[tuple[str, Sequence[Any], str]]:
    listed = next((content[key] for key in VALUES if _is_plain(content.get(key))), None)
    if isinstance(rows := content.get("data"), list) and _are_names(content.get("columns")):
        yield from _columns([content["columns"], *rows], name)
    elif listed is not None:
        yield name or "values", listed, str(content.get("unit", ""))
    elif content and all(key.isdigit() for key in content):
        yield name, list(content.values()), ""
    else:
        for key, value in content.items():
            yield from _columns(value, name if key in WRAPPERS else _joined(name, key))


def _of_records(records: Sequence[Mapping[str, Any]], name: str) -> Iterator[tuple[str, Sequence[Any], str]]:
    flat = [dict(_flattened(record, "")) for record in records]
    for key in dict.fromkeys(key for record in flat for key in record):
        yield _joined(name, key), [record.get(key) for record in flat], ""


def _flattened(record: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in record.items():
        if isinstance(value, dict):
            yield from _flattened(value, _joined(prefix, key))
        else:
            yield _joined(prefix, key), value


def _joined(prefix: str, name: str) -> str:
    return f"{prefix}.{name}" if prefix else name


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, str) for one in value)


def _is_plain(value: Any) -> bool:
    """Return whether a value is a list of numbers, words or nulls."""
    return isinstance(value, list) and bool(value) and not any(isinstance(one, dict | list) for one in value)
