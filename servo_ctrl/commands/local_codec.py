"""Converts status types to JSON of the local socket and back: field names as keys, SI, null for NaN."""

import math
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from servo_ctrl.commands.field import FIELDS_OF
from servo_ctrl.errors import ServoCtrlError

T = TypeVar("T")


class MessageError(ServoCtrlError):
    """A message does not match its type."""


def to_plain(value: Any) -> Any:
    """Convert a value of a status type to objects that `json` encodes."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Enum):
        return value.name.lower()
    if isinstance(value, tuple):
        if hasattr(value, "_fields"):
            return {name: to_plain(getattr(value, name)) for name in published_names(type(value))}
        return [to_plain(element) for element in value]
    return value


def from_plain(kind: type[T], value: Any) -> T:
    """Build a value of a status type from a message. Raises MessageError with the key."""
    built: T = _built(kind, value, "")
    return built


@cache
def published_names(kind: Any) -> tuple[str, ...]:
    """Return the fields of a status type on the local socket, derived fields last."""
    fields = FIELDS_OF.get(kind, {})
    stored: tuple[str, ...] = kind._fields
    names = [*stored, *(name for name in fields if name not in stored)]
    return tuple(name for name in names if name not in fields or fields[name].local)


@cache
def type_hints(kind: Any) -> dict[str, Any]:
    """Return the types of the stored fields of a status type."""
    return get_type_hints(kind)


def record_type(hint: Any) -> Any:
    """Return the status type in a type hint, optional or not; None if the hint is none."""
    if get_origin(hint) is UnionType:
        (hint,) = (argument for argument in get_args(hint) if argument is not NoneType)
    return hint if hasattr(hint, "_fields") else None


def _built(hint: Any, value: Any, place: str) -> Any:
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is UnionType:
        kinds = [argument for argument in arguments if argument is not NoneType]
        if value is None or type(value) in kinds:
            return value
        return _built(kinds[0], value, place)
    if origin is tuple:
        return _tuple(arguments, value, place)
    if hasattr(hint, "_fields"):
        return _record(hint, value, place)
    if issubclass(hint, Enum):
        return _member(hint, value, place)
    return _scalar(hint, value, place)


def _scalar(hint: type, value: Any, place: str) -> Any:
    if hint is float and value is None:
        return math.nan
    if hint is float and type(value) is int:
        return float(value)
    if type(value) is not hint:
        raise MessageError(f"{place}: expected {hint.__name__}, not {value!r:.40}")
    return value


def _tuple(arguments: tuple[Any, ...], value: Any, place: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise MessageError(f"{place}: expected a list, not {value!r:.40}")
    hints = (arguments[0],) * len(value) if arguments[1:] == (...,) else arguments
    if len(hints) != len(value):
        raise MessageError(f"{place}: expected {len(hints)} values, not {len(value)}")
    return tuple(
        _built(hint, element, f"{place}[{number}]")
        for number, (hint, element) in enumerate(zip(hints, value, strict=True))
    )


def _record(kind: Any, value: Any, place: str) -> Any:
    if not isinstance(value, dict):
        raise MessageError(f"{place or kind.__name__}: expected an object, not {value!r:.40}")
    if unknown := value.keys() - set(published_names(kind)):
        raise MessageError(f"{place}.{min(unknown)}".lstrip(".") + ": unknown key")
    hints, built = type_hints(kind), {}
    for name in kind._fields:
        inner = f"{place}.{name}".lstrip(".")
        if name in value:
            built[name] = _built(hints[name], value[name], inner)
        elif name not in kind._field_defaults:
            raise MessageError(f"{inner}: is missing")
    return kind(**built)


def _member(kind: type[Enum], value: Any, place: str) -> Enum:
    try:
        return kind[value.upper()]
    except (KeyError, AttributeError):
        raise MessageError(f"{place}: no {value!r:.40}") from None
