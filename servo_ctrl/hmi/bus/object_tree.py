"""The object dictionary of a node as its EDS describes it: a tree to browse."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.hmi.languages.texts import tr, word


class IntegerType(NamedTuple):
    """A data type of CiA 301 for whole numbers; a BOOLEAN is sent as one byte."""

    name: str
    bits: int
    least: int
    greatest: int


SIGNED = {0x2: 8, 0x3: 16, 0x4: 32, 0x10: 24, 0x12: 40, 0x13: 48, 0x14: 56, 0x15: 64}
"""Bits of a signed integer, by the code of its data type (CiA 301, table 44)."""
UNSIGNED = {0x5: 8, 0x6: 16, 0x7: 32, 0x16: 24, 0x18: 40, 0x19: 48, 0x1A: 56, 0x1B: 64}
"""Bits of an unsigned integer, by the code of its data type (CiA 301, table 44)."""
INTEGERS = (
    {0x1: IntegerType("BOOLEAN", 8, 0, 1)}
    | {
        code: IntegerType(f"INTEGER{bits}", bits, -(1 << bits - 1), (1 << bits - 1) - 1)
        for code, bits in SIGNED.items()
    }
    | {code: IntegerType(f"UNSIGNED{bits}", bits, 0, (1 << bits) - 1) for code, bits in UNSIGNED.items()}
)
"""Integer types by the code of the data type (CiA 301, table 44)."""
REALS = {0x8: "REAL32", 0x11: "REAL64"}
"""Floating-point types by the code of the data type (CiA 301, table 44)."""
TEXTS = {0x9: "VISIBLE_STRING", 0xB: "UNICODE_STRING"}
"""Text types by the code of the data type (CiA 301, table 44)."""
BYTES = {0xA: "OCTET_STRING", 0xC: "TIME_OF_DAY", 0xD: "TIME_DIFFERENCE", 0xF: "DOMAIN"}
"""Types whose values are shown as bytes, by the code of the data type (CiA 301, table 44)."""
MAX_EDS_BYTES = 4_000_000
"""Bounds an EDS file; chosen: those of large drives have a few hundred thousand bytes."""
FIRST_OBJECT = 0x1000
"""First index of an object (CiA 301); indices below are data types, which no node answers for."""
RANGES = (
    (0x11FF, word("Communication")),
    (0x13FF, word("SDO parameters")),
    (0x17FF, word("Receive PDOs")),
    (0x1BFF, word("Transmit PDOs")),
    (0x1FFF, word("Communication, further")),
    (0x5FFF, word("Manufacturer")),
    (0x9FFF, word("Device profile")),
    (0xFFFF, word("Interfaces and reserved")),
)
"""The last index of each range of CiA 301."""


@dataclass(frozen=True, slots=True)
class ObjectEntry:
    """An entry of the dictionary: what one SDO transfer reads or writes."""

    index: int
    subindex: int
    name: str
    type_code: int
    access: str
    """const, ro, wo, rw, rwr or rww."""
    low: int | None = None
    """Limits of the EDS; None: those of the data type."""
    high: int | None = None
    default: str = ""
    """"" without one."""
    object_name: str = ""

    @property
    def address(self) -> str:
        """Index and subindex, as `6064:00`."""
        return f"{self.index:04X}:{self.subindex:02X}"

    @property
    def type_name(self) -> str:
        """The name of the data type in CiA 301."""
        if self.type_code in INTEGERS:
            return INTEGERS[self.type_code].name
        return (REALS | TEXTS | BYTES).get(self.type_code, f"type {self.type_code:02X}h")

    @property
    def readable(self) -> bool:
        """Whether a client may read it."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Whether a client may write it, according to the EDS."""
        return self.access in {"wo", "rw", "rwr", "rww"}

    @property
    def limits(self) -> tuple[int, int] | None:
        """Least and greatest value of an integer; None for other data types."""
        if self.type_code not in INTEGERS:
            return None
        integer = INTEGERS[self.type_code]
        low = integer.least if self.low is None else max(self.low, integer.least)
        high = integer.greatest if self.high is None else min(self.high, integer.greatest)
        return low, high


def load_entries(eds: Path, node_id: int) -> list[ObjectEntry]:
    """Read the entries of an EDS in the order of their addresses. Raises EdsError naming the file."""
    # the canopen library takes some 60 MB, and most processes never show a tree
    from servo_ctrl.canopen.stack import load_eds  # noqa: PLC0415

    _refuse_other_files(eds)
    return [
        ObjectEntry(
            index=index,
            subindex=subindex,
            name=v.label,
            type_code=v.data_type,
            access=v.access,
            low=v.low,
            high=v.high,
            default=v.default_text,
            object_name=v.object_label,
        )
        for (index, subindex), v in sorted(load_eds(eds, node_id).variables.items())
        if v.index >= FIRST_OBJECT
    ]


def tree_nodes(entries: Iterable[ObjectEntry]) -> list[dict[str, Any]]:
    """Return the entries as branches of `ui.tree`: ranges of the index, and objects in them."""
    nodes = []
    for name, inside in groupby(entries, lambda entry: next(r for last, r in RANGES if entry.index <= last)):
        objects = [_object_node(list(found)) for _, found in groupby(inside, lambda entry: entry.index)]
        nodes.append({"id": name, "label": tr(name), "children": objects})
    return nodes


def _object_node(entries: Sequence[ObjectEntry]) -> dict[str, Any]:
    """Return the branch of an object; one whose only entry is subindex 0 is a leaf."""
    leaves = [{"id": entry.address, "label": f"{entry.address} {entry.name}"} for entry in entries]
    first = entries[0]
    if len(leaves) == 1 and first.subindex == 0:
        return leaves[0]
    return {"id": f"{first.index:04X}", "label": f"{first.index:04X} {first.object_name}", "children": leaves}


def _refuse_other_files(eds: Path) -> None:
    """Refuse a file that is not an EDS before the library reads it whole."""
    try:
        with eds.open("rb") as file:
            text = file.read(MAX_EDS_BYTES + 1)
    except FileNotFoundError:
        raise EdsError(f"{eds}: no such EDS file") from None
    except OSError as error:
        raise EdsError(f"{eds}: cannot be read: {error.strerror}") from None
    if len(text) > MAX_EDS_BYTES:
        raise EdsError(f"{eds}: is not an EDS: it has more than {MAX_EDS_BYTES} bytes")
    if b"[deviceinfo]" not in text.lower():
        raise EdsError(f"{eds}: not a readable EDS: it has no section DeviceInfo")
