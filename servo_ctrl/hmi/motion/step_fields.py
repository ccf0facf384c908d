"""The keys of a program's steps as fields of a form, derived from the types that check a program file.

Without NiceGUI: what a form shows for a step, and what the step becomes when a field was filled in.
"""

import math
import tomllib
from collections.abc import Sequence
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel

from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.config.program_model import StepConfig
from servo_ctrl.files.toml_text import toml_text

_UNITS = {
    "_mm_min": "mm/min",
    "_mm_s2": "mm/s\N{SUPERSCRIPT TWO}",
    "_mm_s": "mm/s",
    "_mm": "mm",
    "_hz": "Hz",
    "_s": "s",
}
"""By the ending of a key; longer endings first."""
MAX_DEPTH = 8
"""Bounds the nested levels of a step that the form accepts; chosen: a valid step has three."""
WITHOUT_FORM = frozenset({"samples"})
"""Kinds of step that name columns of a file: they are edited as text."""
MODELS: dict[str, type[BaseModel]] = {
    get_args(model.model_fields["kind"].annotation)[0]: model for model in get_args(get_args(StepConfig)[0])
}
"""By the kind of step."""


class StepField(NamedTuple):
    """One field of a step."""

    key: str
    label: str
    unit: str
    meaning: str
    kind: str
    """Of the value: "number", "integer", "string" or "axes"."""
    axis: str = ""
    """The axis, where the key has a value for each axis."""
    options: tuple[str, ...] = ()
    """Values to choose from; without them a number or text is typed."""
    required: bool = False
    default: str = ""

    @property
    def name(self) -> str:
        """The label without the axis, in English; the form translates it."""
        return self.label.removesuffix(f" {self.axis}") if self.axis else self.label


def fields_of(kind: str, axes: Sequence[str]) -> list[StepField]:
    """Return the fields of a kind of step, in the order of its type."""
    schema = MODELS[kind].model_json_schema()
    found = []
    for key, described in schema["properties"].items():
        if key != "kind":
            found += _fields(key, described, key in schema.get("required", ()), axes)
    return found


def _fields(key: str, described: dict[str, Any], required: bool, axes: Sequence[str]) -> list[StepField]:
    value = next((one for one in described.get("anyOf", ()) if one["type"] != "null"), described)
    ending, unit = next(((ending, unit) for ending, unit in _UNITS.items() if key.endswith(ending)), ("", ""))
    name, meaning = key.removesuffix(ending).replace("_", " "), described.get("description", "")
    if value["type"] == "object":
        return [StepField(key, f"{name} {axis}", unit, meaning, "number", axis=axis) for axis in axes]
    if value["type"] == "array":
        pairs = tuple(f"{first} {second}" for first in axes for second in axes if first != second)
        return [StepField(key, name, "", meaning, "axes", options=pairs, required=required)]
    options = tuple(value.get("enum", ())) or (tuple(axes) if key == "axis" else ())
    default = described.get("default")
    field = StepField(key, name, unit, meaning, value["type"], options=options, required=required)
    return [field._replace(default="" if default is None else str(default))]


def shown_value(step: dict[str, Any], field: StepField) -> str:
    """Return the value of a field as the form shows it; "" where the step has none."""
    value = step.get(field.key)
    if field.axis:
        value = value.get(field.axis) if isinstance(value, dict) else None
    if value is None:
        return ""
    return " ".join(str(part) for part in value) if isinstance(value, list) else str(value)


def put_value(step: dict[str, Any], field: StepField, written: str) -> None:
    """Put into the step what was typed in a field; an empty field removes its key.

    Text that is not a number is put in unchanged, so that the loader reports it.
    """
    written = written.strip()
    value: Any = None if not written else _value(field, written)
    if field.axis:
        by_axis = dict(step[field.key]) if isinstance(step.get(field.key), dict) else {}
        _set(by_axis, field.axis, value)
        value = by_axis
    _set(step, field.key, value)


def _set(table: dict[str, Any], key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


def _value(field: StepField, written: str) -> Any:
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
    """Return the steps of a program's text; None where the form cannot show them, for whatever reason."""
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError):  # numbers of 5000 digits and deep nesting are not TOMLDecodeError
        return None
    steps = document.get("step")
    if set(document) - {"format", "step"} or not isinstance(steps, list):
        return None
    if document.get("format", FORMAT) != FORMAT:
        return None
    if not all(isinstance(step, dict) and isinstance(step.get("kind"), str) for step in steps):
        return None
    if any(_is_deeper(step, MAX_DEPTH) for step in steps):
        return None  # no valid step, and the recursion of the TOML writer might end in an error
    return steps if all(step["kind"] in MODELS for step in steps) else None


def _is_deeper(value: Any, levels: int) -> bool:
    """Whether tables and lists are nested deeper than this number of levels."""
    if not isinstance(value, dict | list):
        return False
    parts = value.values() if isinstance(value, dict) else value
    return levels == 0 or any(_is_deeper(part, levels - 1) for part in parts)


def text_of(steps: list[dict[str, Any]]) -> str:
    """Return the text of a program file with these steps."""
    return toml_text({"format": FORMAT, "step": steps})


def caption_of(step: dict[str, Any]) -> str:
    """Return the kind and the first values of a step, so that it can be found without opening it."""
    shown = [str(step["kind"])]
    for key, value in step.items():
        if key in {"kind", "label"}:
            continue
        unit = next((f" {unit}" for ending, unit in _UNITS.items() if key.endswith(ending)), "")
        if isinstance(value, dict):
            numbers = {axis: number for axis, number in value.items() if isinstance(number, int | float)}
            shown += [f"{axis} {number:g}{unit}" for axis, number in numbers.items()]
        elif isinstance(value, int | float):
            shown.append(f"{value:g}{unit}")
    return ", ".join(shown[:5])
