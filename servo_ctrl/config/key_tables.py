"""Generates the key tables of docs/machines.md and docs/programs.md from the types that check the files.

`python -m servo_ctrl.config.key_tables docs/machines.md docs/programs.md` rewrites the tables between their
marks; a test compares the documents with `filled`.
"""

import json
import re
import sys
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from servo_ctrl.config import (
    contour_model,
    learning_model,
    model,
    mqtt_model,
    node_model,
    plant_model,
    program_model,
)
from servo_ctrl.config.law_sections import SECTION_TYPES

SECTIONS: dict[str, Any] = {
    "machine": model.MachineSection,
    "bus": model.Bus,
    "controller": node_model.Controller,
    "axis.NAME": model.AxisConfig,
    "axis.NAME.drive": node_model.Drive,
    "axis.NAME.scale": node_model.Scale,
    "axis.NAME.temperature": node_model.Temperature,
    "axis.NAME.drive.pdo.NAME": node_model.Pdo,
    "axis.NAME.transmission": model.Transmission,
    "axis.NAME.limits": model.Limits,
    "axis.NAME.control": model.Control,
    "axis.NAME.input_shaper": model.InputShaper,
    "axis.NAME.measured_plant": plant_model.MeasuredPlant,
    **{f"axis.NAME.{name}": kind for name, kind in SECTION_TYPES.items()},
    "contour_control": contour_model.ContourControl,
    "monitoring": learning_model.MonitoringConfig,
    "learning": learning_model.LearningConfig,
    "mqtt": mqtt_model.MqttConfig,
    "move": program_model.MoveStep,
    "circle": program_model.CircleStep,
    "sine": program_model.SineStep,
    "s_shape": program_model.SShapeStep,
    "dwell": program_model.DwellStep,
    "samples": program_model.SamplesStep,
}
"""The type of each table in the documents."""

_MARKED = re.compile(r"(<!-- keys: (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


def filled(document: str) -> str:
    """Return the document with every marked table generated anew. Raises KeyError for an unknown mark."""
    return _MARKED.sub(lambda match: match[1] + key_table(SECTIONS[match[2]]) + match[3], document)


def key_table(section: Any) -> str:
    """Return a Markdown table of key, value, default, meaning, with one row for each key of a section."""
    schema = TypeAdapter(section).json_schema()
    fields = section.__pydantic_fields__
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key, entry in schema["properties"].items():
        if "$ref" in str(entry):  # a nested section has its own table
            continue
        field = fields[key]
        value = field.get_default(call_default_factory=True)
        default = "required" if field.is_required() else _shown_default(value)
        rows.append(f"| `{key}` | {_shown_value(entry)} | {default} | {entry['description']} |")
    return "\n".join(rows) + "\n"


def _shown_default(value: Any) -> str:
    return "none" if value is None or value == {} else f"`{json.dumps(value)}`"


def _shown_value(entry: dict[str, Any]) -> str:
    if "anyOf" in entry:
        return _shown_value(entry["anyOf"][0])
    if "const" in entry:
        return f'`"{entry["const"]}"`'
    if "enum" in entry:
        return ", ".join(f'`"{choice}"`' for choice in entry["enum"])
    if entry["type"] == "array":
        lowest, highest = entry["minItems"], entry["maxItems"]
        count = f"{lowest}" if lowest == highest else f"{lowest} to {highest}"
        return f"{count} of: {_shown_value(entry['items'])}"
    if entry["type"] == "object":
        return "axis = " + _shown_value(next(iter(entry["patternProperties"].values())))
    plain = {"string": "text", "integer": "whole number", "number": "number", "boolean": "true or false"}
    kind = str(entry.get("format", plain[entry["type"]]))
    return kind + _shown_range(entry)


def _shown_range(entry: dict[str, Any]) -> str:
    bounds = (("> ", "exclusiveMinimum"), (">= ", "minimum"), ("<= ", "maximum"))
    shown = [f"{sign}{entry[name]:.10g}" for sign, name in bounds if name in entry]
    return " " + ", ".join(shown) if shown else ""


def main() -> None:
    """Rewrite the documents named on the command line."""
    for name in sys.argv[1:]:
        path = Path(name)
        path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
