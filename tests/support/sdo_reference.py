"""What a CANopen device answers to SDO by CiA 301, from its EDS alone: it shares no line with the server.

The file is read with configparser; sizes, access, limits and the order of refusals are those of the standard
(7.2.4.3.17 and table 22).
"""

from configparser import RawConfigParser, SectionProxy
from pathlib import Path
from typing import NamedTuple

READ_OF_WRITE_ONLY, WRITE_OF_READ_ONLY = 0x06010001, 0x06010002
NO_OBJECT, NO_SUBINDEX = 0x06020000, 0x06090011
TOO_LONG, TOO_SHORT, TOO_HIGH, TOO_LOW = 0x06070012, 0x06070013, 0x06090031, 0x06090032
NO_DATA = 0x08000024
BYTES = {0x2: 1, 0x3: 2, 0x4: 4, 0x5: 1, 0x6: 2, 0x7: 4}
SIGNED = {0x2, 0x3, 0x4}
Address = tuple[int, int]


class Entry(NamedTuple):
    """One object: size in bytes (None: any), sign, access, limits."""

    size: int | None
    signed: bool
    access: str
    low: int | None
    high: int | None
    default: bytes | None
    """Default value; None if the hardware supplies it, or there is none."""


class ReferenceDictionary:
    """Objects and their values, as a client must find them."""

    def __init__(self, eds: Path, node_id: int) -> None:
        parser = RawConfigParser()
        parser.optionxform = str  # type: ignore[assignment,method-assign]  # keys keep their case
        parser.read_string(eds.read_text(encoding="ascii"))
        self.entries: dict[Address, Entry] = {}
        for name in parser.sections():
            index, _, subindex = name.partition("sub")
            if len(index) != 4 or any(digit not in "0123456789ABCDEF" for digit in index):
                continue
            if "DataType" in parser[name]:
                self.entries[int(index, 16), int(subindex or "0", 16)] = _entry(parser[name], node_id)
        self.values: dict[Address, bytes] = {}

    def upload(self, index: int, subindex: int) -> bytes | int:
        """Return the data of an upload, or its abort code."""
        entry = self._find(index, subindex)
        if isinstance(entry, int):
            return entry
        if entry.access == "wo":
            return READ_OF_WRITE_ONLY
        value = self.values.get((index, subindex), entry.default)
        return value or NO_DATA

    def download(self, index: int, subindex: int, data: bytes) -> int:
        """Return 0 for an accepted download, else its abort code."""
        entry = self._find(index, subindex)
        if isinstance(entry, int):
            return entry
        if entry.access in {"ro", "const"}:
            return WRITE_OF_READ_ONLY
        if entry.size is not None:
            if len(data) != entry.size:
                return TOO_LONG if len(data) > entry.size else TOO_SHORT
            value = int.from_bytes(data, "little", signed=entry.signed)
            if entry.high is not None and value > entry.high:
                return TOO_HIGH
            if entry.low is not None and value < entry.low:
                return TOO_LOW
        self.values[index, subindex] = data
        return 0

    def _find(self, index: int, subindex: int) -> Entry | int:
        if (index, subindex) in self.entries:
            return self.entries[index, subindex]
        return NO_SUBINDEX if any(known == index for known, _ in self.entries) else NO_OBJECT


def _entry(section: SectionProxy, node_id: int) -> Entry:
    def number(key: str) -> int | None:
        text = section.get(key, "")
        return (
            sum(int(part, 0) for part in text.replace("$NODEID", str(node_id)).split("+")) if text else None
        )

    kind = int(section["DataType"], 0)
    size, signed = BYTES.get(kind), kind in SIGNED
    default = None
    if size is not None:
        given = number("DefaultValue")
        default = None if given is None else given.to_bytes(size, "little", signed=signed)
    elif kind == 0x9:
        default = section.get("DefaultValue", "").encode()
    return Entry(
        size=size,
        signed=signed,
        access=section["AccessType"],
        low=number("LowLimit"),
        high=number("HighLimit"),
        default=default,
    )
