"""The objects of a node as its EDS describes them: a tree to browse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

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


def entries_of(tree: tuple[IndexRange, ...]) -> Iterator[Entry]:
    """All entries in order."""
    for part in tree:
        for one in part.objects:
            yield from one.entries
