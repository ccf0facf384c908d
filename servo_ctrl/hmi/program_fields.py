"""The keys of a program's steps as fields of a form, made from the types that check a program file.

No browser in here: what is shown for a step, and what the step becomes when something was written.
"""

from __future__ import annotations

import math
import tomllib
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import tomli_w

from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.config.program_model import StepConfig

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pydantic import BaseModel

_UNITS = (
    ("_mm_min", "mm/min"),
    ("_mm_s2", "mm/s\N{SUPERSCRIPT TWO}"),
    ("_mm_s", "mm/s"),
    ("_mm", "mm"),
    ("_hz", "Hz"),
    ("_s", "s"),
)
DEEPEST = 8
"""Levels of a step; those that there are have three."""
FORMLESS = frozenset({"samples"})
"""Kinds with columns of a file, which are better written than filled in."""
MODELS: dict[str, type[BaseModel]] = {
    get_args(model.model_fields["kind"].annotation)[0]: model for model in get_args(get_args(StepConfig)[0])
}
"""By the kind of step."""


class Field(NamedTuple):
    """One key of a step; `item` is the axis where the key has a value for each."""

    key: str
    item: str
    label: str
    unit: str
    meaning: str
    options: tuple[str, ...]
    """What can be chosen; none: a number or text is written."""
    kind: str
    """Of the value: "number", "integer", "string" or "axes"."""
    required: bool
    default: str


def fields_of(kind: str, axes: Sequence[str]) -> list[Field]:
    """The fields of a kind of step, in the order of its type."""
    schema = MODELS[kind].model_json_schema()
    found = []
    for key, described in schema["properties"].items():
        if key != "kind":
            found += _fields(key, described, key in schema.get("required", ()), axes)
    return found


def _fields(key: str, described: dict[str, Any], required: bool, axes: Sequence[str]) -> list[Field]:
    value = next((one for one in described.get("anyOf", ()) if one["type"] != "null"), described)
    unit = next((unit for ending, unit in _UNITS if key.endswith(ending)), "")
    name = key.removesuffix(next((ending for ending, _ in _UNITS if key.endswith(ending)), "")).replace(
        "_", " "
    )
    default = described.get("default")
    meaning, shown_default = described.get("description", ""), "" if default is None else str(default)
    if value["type"] == "object":
        return [Field(key, axis, f"{name} {axis}", unit, meaning, (), "number", False, "") for axis in axes]
    if value["type"] == "array":
        pairs = tuple(f"{first} {second}" for first in axes for second in axes if first != second)
        return [Field(key, "", name, "", meaning, pairs, "axes", required, "")]
    options = tuple(value.get("enum", ())) or (tuple(axes) if key == "axis" else ())
    return [Field(key, "", name, unit, meaning, options, value["type"], required, shown_default)]


def shown_value(step: dict[str, Any], field: Field) -> str:
    """What the file has for a field, as it is written in the form; "" where it has nothing."""
    value = step.get(field.key)
    if field.item:
        value = value.get(field.item) if isinstance(value, dict) else None
    if value is None:
        return ""
    return " ".join(str(part) for part in value) if isinstance(value, list) else str(value)


def put_value(step: dict[str, Any], field: Field, written: str) -> None:
    """Put into the file's step what was written in the form; nothing takes the key out.

    What is no number is put in as it is: the loader says what is wrong with it.
    """
    written = written.strip()
    value: Any = None if not written else _value(field, written)
    if not field.item:
        _set(step, field.key, value)
        return
    table = dict(step[field.key]) if isinstance(step.get(field.key), dict) else {}
    _set(table, field.item, value)
    _set(step, field.key, table)


def _set(table: dict[str, Any], key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


def _value(field: Field, written: str) -> Any:
    if field.kind == "axes":
        return written.split()
    if field.kind not in {"number", "integer"}:
        return written
    try:
        number = float(written.replace(",", "."))
    except ValueError:
        return written
    if not math.isfinite(number):
        return written
    return int(number) if field.kind == "integer" and number.is_integer() else number


def steps_of(text: str) -> list[dict[str, Any]] | None:
    """The steps of a program's text; None where the form cannot show them, whatever the reason."""
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError):  # numbers of 5000 digits and deep nesting are no TOMLDecodeError
        return None
    steps = document.get("step")
    if set(document) - {"format", "step"} or not isinstance(steps, list):
        return None
    if document.get("format", FORMAT) != FORMAT:
        return None
    if not all(isinstance(step, dict) and isinstance(step.get("kind"), str) for step in steps):
        return None
    if any(_deeper(step, DEEPEST) for step in steps):
        return None  # no step that there is, and perhaps more than can be written again
    return steps if all(step["kind"] in MODELS for step in steps) else None


def _deeper(value: Any, levels: int) -> bool:
    """Whether tables and lists are nested deeper than so."""
    if not isinstance(value, dict | list):
        return False
    parts = value.values() if isinstance(value, dict) else value
    return levels == 0 or any(_deeper(part, levels - 1) for part in parts)


def text_of(steps: list[dict[str, Any]]) -> str:
    """A program file with these steps."""
    return tomli_w.dumps({"format": FORMAT, "step": steps})


def caption_of(step: dict[str, Any]) -> str:
    """The kind and the first values, to find a step without opening it."""
    shown = [str(step["kind"])]
    for key, value in step.items():
        if key in {"kind", "label"}:
            continue
        unit = next((f" {unit}" for ending, unit in _UNITS if key.endswith(ending)), "")
        if isinstance(value, dict):
            shown += [
                f"{axis} {number:g}{unit}"
                for axis, number in value.items()
                if isinstance(number, int | float)
            ]
        elif isinstance(value, int | float):
            shown.append(f"{value:g}{unit}")
    return ", ".join(shown[:5])
