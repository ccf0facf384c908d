"""The tree of a node's objects from its EDS.

The canopen library reads the file, as everywhere; nothing of its network is used here.
"""

from __future__ import annotations

import configparser
from typing import TYPE_CHECKING

from canopen.objectdictionary import ObjectDictionaryError, ODVariable, import_od

from servo_ctrl.config.errors import ServoCtrlError, first_line
from servo_ctrl.hmi.object_tree import Entry, IndexRange, Object

if TYPE_CHECKING:
    from pathlib import Path

LARGEST_EDS = 4_000_000
"""Bytes; ours have 40 thousand, those of large drives a few hundred thousand."""
FIRST_OBJECT = 0x1000
"""Below are data types, nothing that a node would answer."""

RANGES = (
    (0x11FF, "Communication"),
    (0x13FF, "SDO parameters"),
    (0x17FF, "Receive PDOs"),
    (0x1BFF, "Transmit PDOs"),
    (0x1FFF, "Communication, further"),
    (0x5FFF, "Manufacturer"),
    (0x9FFF, "Device profile"),
    (0xFFFF, "Interfaces and reserved"),
)
"""Last index of a range, and what CiA 301 has it for."""


class TreeError(ServoCtrlError):
    """An EDS that cannot be browsed."""


def load_tree(eds: Path, node_id: int) -> tuple[IndexRange, ...]:
    """The objects of an EDS by ranges of the index. Raises TreeError naming the file."""
    try:
        with eds.open("rb") as file:
            text = file.read(LARGEST_EDS + 1)
        if len(text) > LARGEST_EDS:
            raise TreeError(f"{eds}: is no EDS: it has more than {LARGEST_EDS} bytes")
        if b"[deviceinfo]" not in text.lower():
            raise TreeError(f"{eds}: not a readable EDS: it has no section DeviceInfo")
        dictionary = import_od(str(eds), node_id)
    except FileNotFoundError:
        raise TreeError(f"{eds}: no such EDS file") from None
    except OSError as error:
        raise TreeError(f"{eds}: cannot be read: {error.strerror}") from None
    except (configparser.Error, ObjectDictionaryError, ValueError, KeyError, AttributeError) as error:
        raise TreeError(f"{eds}: not a readable EDS: {first_line(error)}") from None
    objects = [_object(source) for _, source in sorted(dictionary.items()) if source.index >= FIRST_OBJECT]
    ranges, first = [], FIRST_OBJECT
    for last, name in RANGES:
        inside = tuple(one for one in objects if first <= one.index <= last)
        if inside:
            ranges.append(IndexRange(name, inside))
        first = last + 1
    return tuple(ranges)


def _object(source: ODVariable) -> Object:
    variables = [source] if isinstance(source, ODVariable) else list(source.values())
    entries = tuple(_entry(one) for one in variables)
    return Object(source.index, str(source.name), entries)


def _entry(source: ODVariable) -> Entry:
    default = "" if source.default is None else str(source.default)
    return Entry(
        source.index,
        source.subindex,
        str(source.name),
        source.data_type or 0,
        str(source.access_type),
        source.min,
        source.max,
        default,
    )
