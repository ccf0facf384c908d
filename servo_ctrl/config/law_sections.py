"""Derives the machine-file types of the control law's sections from the declarations of its parts."""

import dataclasses
import math
import sys
from collections.abc import Iterator
from typing import Annotated, Any, get_args, get_type_hints

from pydantic import ConfigDict, Field, Strict
from pydantic.dataclasses import dataclass

from kernels.record_layout import kinds_of
from servo_ctrl.config.node_model import is_mapped
from servo_ctrl.control.section import Key, LawSection, Need
from servo_ctrl.control.tick import AxisParams


def _sections() -> dict[str, LawSection]:
    sections = {}
    for field, kind in kinds_of(AxisParams).items():
        section = getattr(sys.modules[kind.__module__], "SECTION", None)
        if section is not None:
            sections[field] = section
    return sections


SECTIONS = _sections()
"""Field of `AxisParams` -> section."""


MEASURED_CURRENT = ("current_actual_value", "0x6078:00")
"""Name and address of the object with the measured current."""
_NUMBERS = {float, int}


def _checked_type(name: str) -> Any:
    """Make the type of the section `name`, with the keys of every part that reads it."""
    settings = [section.settings for section in SECTIONS.values() if section.name == name]
    fields = [
        (field.name, _annotated(get_type_hints(part, include_extras=True)[field.name]), field)
        for part in settings
        for field in dataclasses.fields(part)
    ]
    first = settings[0]
    typed_fields = [(key, kind, dataclasses.field(default=field.default)) for key, kind, field in fields]
    section_type = dataclasses.make_dataclass(
        first.__name__, typed_fields, bases=tuple(reversed(settings)), frozen=True, kw_only=True
    )
    section_type.__doc__, section_type.__module__ = first.__doc__, first.__module__
    return dataclass(
        section_type, config=ConfigDict(extra="forbid", allow_inf_nan=False), frozen=True, kw_only=True
    )


def _annotated(hint: Any) -> Any:
    """Return the annotated type that checks a key, from its type and its `Key`."""
    kind, key = get_args(hint)[0], get_args(hint)[1]
    options = set(get_args(kind)) or {kind}
    if not options & _NUMBERS:
        return Annotated[kind, Field(description=key.meaning)]
    number: Any = Annotated[next(iter(options & _NUMBERS)), Strict(), _bounds(key)]
    checked = number | None if type(None) in options else number
    return Annotated[checked, Field(description=key.meaning)]


def _bounds(key: Key) -> Any:
    return Field(gt=key.above, ge=key.at_least, le=key.at_most)


SECTION_TYPES: dict[str, Any] = {
    name: _checked_type(name) for name in dict.fromkeys(section.name for section in SECTIONS.values())
}
"""The type that checks each section, by name."""
MEANINGS = {section.name: section.meaning for section in SECTIONS.values()}
"""The meaning of each section, for documents and forms."""


def objections(axis: Any) -> Iterator[str]:
    """Yield why sections of the law contradict themselves or other keys of the axis (`AxisConfig`)."""
    resolution_um = math.nan if axis.scale is None else axis.scale.resolution_um
    for section in SECTIONS.values():
        settings = axis.section(section.settings)
        if settings is None:
            continue
        for need in section.needs:
            if text := _unmet_need(need, axis, section.name):
                yield text
        if section.objection is not None and (text := section.objection(settings, resolution_um)):
            yield f"{section.name}.{text}"


def period_objections(axis: Any, period_s: float) -> Iterator[str]:
    """Yield why sections of an axis's law contradict the SYNC period."""
    for section in SECTIONS.values():
        settings = axis.section(section.settings)
        if settings is None or section.period_objection is None:
            continue
        if text := section.period_objection(settings, period_s):
            yield f"{section.name}.{text}"


def _unmet_need(need: Need, axis: Any, name: str) -> str:
    """Return what the section `name` needs and the axis lacks, else ""."""
    match need:
        case Need.VELOCITY_SET_POINT if axis.mode == "csp":
            return f"{name}: mode csp has no velocity set point of the controller"
        case Need.FORCE_SET_POINT if axis.mode != "cst":
            return f"{name}: only mode cst has a force set point"
        case Need.MEASURED_CURRENT if not is_mapped(axis.drive.received_every_cycle, MEASURED_CURRENT):
            return f'drive.tpdo1: "current_actual_value" is missing; the {name} needs it'
        case Need.SCALE if axis.scale is None:
            return f"{name}: there is no scale section to read"
        case Need.MOTOR_LED if axis.mode != "csp" and axis.control.feedback != "motor":
            return f'{name}: needs mode csp, or control.feedback "motor"'
        case _:
            return ""
