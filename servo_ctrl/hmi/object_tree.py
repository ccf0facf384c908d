"""The objects of a node as its EDS describes them: a tree to browse.

The canopen library reads the file, as everywhere; nothing of its network is used here.
"""

from __future__ import annotations

import configparser
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from canopen.objectdictionary import ObjectDictionaryError, ODVariable, import_od

from servo_ctrl.config.errors import ServoCtrlError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

LARGEST_EDS = 4_000_000
"""Bytes; ours have 40 thousand, those of large drives a few hundred thousand."""
FIRST_OBJECT = 0x1000
"""Below are data types, nothing that a node would answer."""

INTEGERS = {
    0x1: ("BOOLEAN", 0, 1),
    **{
        code: (f"INTEGER{bits}", -(1 << bits - 1), (1 << bits - 1) - 1)
        for code, bits in (
            (0x2, 8),
            (0x3, 16),
            (0x4, 32),
            (0x10, 24),
            (0x12, 40),
            (0x13, 48),
            (0x14, 56),
            (0x15, 64),
        )
    },
    **{
        code: (f"UNSIGNED{bits}", 0, (1 << bits) - 1)
        for code, bits in (
            (0x5, 8),
            (0x6, 16),
            (0x7, 32),
            (0x16, 24),
            (0x18, 40),
            (0x19, 48),
            (0x1A, 56),
            (0x1B, 64),
        )
    },
}
"""Data type of CiA 301, table 44: its name, least and greatest value."""
REALS = {0x8: "REAL32", 0x11: "REAL64"}
TEXTS = {0x9: "VISIBLE_STRING", 0xB: "UNICODE_STRING"}
BYTES = {0xA: "OCTET_STRING", 0xC: "TIME_OF_DAY", 0xD: "TIME_DIFFERENCE", 0xF: "DOMAIN"}
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


@dataclass(frozen=True, slots=True)
class Entry:
    """What can be read or written by one SDO transfer."""

    index: int
    subindex: int
    name: str
    type_code: int
    access: str
    """const, ro, wo, rw, rwr or rww."""
    low: int | None
    """Limits of the EDS; None: those of the type."""
    high: int | None
    default: str
    """"" without one."""

    @property
    def address(self) -> str:
        """`6064:00`."""
        return f"{self.index:04X}:{self.subindex:02X}"

    @property
    def type_name(self) -> str:
        """As CiA 301 has it."""
        if self.type_code in INTEGERS:
            return INTEGERS[self.type_code][0]
        return (REALS | TEXTS | BYTES).get(self.type_code, f"type {self.type_code:02X}h")

    @property
    def readable(self) -> bool:
        """A client may read it."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """A client may write it, as far as the EDS says."""
        return self.access in {"wo", "rw", "rwr", "rww"}

    @property
    def limits(self) -> tuple[int, int] | None:
        """Least and greatest value of an integer; None for everything else."""
        if self.type_code not in INTEGERS:
            return None
        _, least, greatest = INTEGERS[self.type_code]
        low = least if self.low is None else max(self.low, least)
        high = greatest if self.high is None else min(self.high, greatest)
        return low, high


@dataclass(frozen=True, slots=True)
class Object:
    """An index with its entries."""

    index: int
    name: str
    entries: tuple[Entry, ...]


class IndexRange(NamedTuple):
    """A part of the dictionary."""

    name: str
    objects: tuple[Object, ...]


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
        reason = (str(error) or repr(error)).splitlines()[0]
        raise TreeError(f"{eds}: not a readable EDS: {reason}") from None
    objects = [_object(source) for _, source in sorted(dictionary.items()) if source.index >= FIRST_OBJECT]
    ranges, first = [], FIRST_OBJECT
    for last, name in RANGES:
        inside = tuple(one for one in objects if first <= one.index <= last)
        if inside:
            ranges.append(IndexRange(name, inside))
        first = last + 1
    return tuple(ranges)


def entries_of(tree: tuple[IndexRange, ...]) -> Iterator[Entry]:
    """All entries in order."""
    for part in tree:
        for one in part.objects:
            yield from one.entries


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
