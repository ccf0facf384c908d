"""500 random SDO dialogues through python-canopen, equal to a model of the standard (CiA 301, 7.2.4).

The model knows the EDS by its own reading of the file and values as Python integers; server and client are
others' code to it. What it predicts of each request: the value, or the abort code.
"""

import configparser
import random
from pathlib import Path

import canopen
from canopen.sdo.exceptions import SdoAbortedError
from in_process_nodes import DRIVE, EDS, InProcessNodes

DIALOGUES = 500
SIZES = {2: (1, True), 3: (2, True), 4: (4, True), 5: (1, False), 6: (2, False), 7: (4, False)}
"""Data type (CiA 301, table 44) -> bytes, signed."""
NO_OBJECT, NO_SUBINDEX = 0x06020000, 0x06090011
WRITE_ONLY, READ_ONLY = 0x06010001, 0x06010002
TOO_LONG, TOO_SHORT, TOO_HIGH, TOO_LOW = 0x06070012, 0x06070013, 0x06090031, 0x06090032
STEADY = (
    0x6065,
    0x6066,
    0x6067,
    0x6068,
    0x606D,
    0x606E,
    0x6081,
    0x6083,
    0x6084,
    0x6085,
    0x609A,
    0x60C5,
    0x607F,
)
"""Objects that keep a written value while the drive has no power and does not move."""


class Model:
    """Answers of a node that complies with the standard, for objects of `STEADY` and for missing ones."""

    def __init__(self, eds: Path) -> None:
        parser = configparser.ConfigParser(interpolation=None)
        parser.read(eds, encoding="ascii")
        self._sections = {name.upper(): parser[name] for name in parser.sections()}
        self._written: dict[int, int] = {}

    def read(self, index: int, subindex: int) -> int:
        """Return the value as an unsigned number, or the negated abort code."""
        section = self._section(index, subindex)
        if isinstance(section, int):
            return -section
        if section["AccessType"] == "wo":
            return -WRITE_ONLY
        size, _signed = SIZES[int(section["DataType"], 0)]
        value = self._written.get(index, int(section.get("DefaultValue", "0") or "0", 0))
        return value % (1 << 8 * size)

    def write(self, index: int, subindex: int, data: bytes) -> int:
        """Return 0, or the negated abort code."""
        section = self._section(index, subindex)
        if isinstance(section, int):
            return -section
        if section["AccessType"] in {"ro", "const"}:
            return -READ_ONLY
        size, signed = SIZES[int(section["DataType"], 0)]
        if len(data) != size:
            return -(TOO_LONG if len(data) > size else TOO_SHORT)
        value = int.from_bytes(data, "little", signed=signed)
        if "HighLimit" in section and value > int(section["HighLimit"], 0):
            return -TOO_HIGH
        if "LowLimit" in section and value < int(section["LowLimit"], 0):
            return -TOO_LOW
        self._written[index] = value
        return 0

    def _section(self, index: int, subindex: int) -> configparser.SectionProxy | int:
        section = self._sections.get(f"{index:04X}")
        if section is None:
            return NO_OBJECT
        return section if subindex == 0 else NO_SUBINDEX


def test_random_dialogues_are_those_of_the_standard() -> None:
    node: canopen.RemoteNode = InProcessNodes().remote(DRIVE)
    model, draw = Model(EDS / "servo_drive.eds"), random.Random(23)
    seen: set[int] = set()
    for number in range(DIALOGUES):
        index = draw.choice((*STEADY, *STEADY, 0x1000, 0x6041, draw.randrange(0x3000, 0x5FFF)))
        subindex = draw.choice((0, 0, 0, 0, draw.randrange(1, 255)))
        if draw.random() < 0.5 and index != 0x6041:
            expected = model.read(index, subindex)
            try:
                found = int.from_bytes(node.sdo.upload(index, subindex), "little")
            except SdoAbortedError as abort:
                found = -abort.code
        else:
            size = draw.choice((1, 2, 4, 4, 4, 5, 9))
            data = draw.choice((draw.randbytes(size), bytes(size), b"\xff" * size))
            expected = model.write(index, subindex, data)
            try:
                node.sdo.download(index, subindex, data, force_segment=draw.random() < 0.3)
                found = 0
            except SdoAbortedError as abort:
                found = -abort.code
        assert found == expected, f"dialogue {number}: {index:04X}h:{subindex:02X}"
        seen.add(min(0, found))
    assert seen >= {0, *(-code for code in (NO_OBJECT, NO_SUBINDEX, READ_ONLY, TOO_LONG, TOO_SHORT, TOO_LOW))}
