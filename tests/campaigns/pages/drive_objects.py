"""docs/drive_objects.md: every object of the simulated drive and scale, from their EDS files alone."""

import re
from collections.abc import Iterator
from configparser import RawConfigParser, SectionProxy
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

TYPES = {2: "i8", 3: "i16", 4: "i32", 5: "u8", 6: "u16", 7: "u32", 9: "text", 15: "domain"}
RECEIVED, SENT = {"rw", "rww", "wo"}, {"ro", "rw", "rwr", "const"}
INTRODUCTION = """# Objects of drive and scale

Every object that the simulated CiA 402 drive and the CiA 406 linear scale have. The lists are made from
`eds/servo_drive.eds` and `eds/linear_scale.eds` by `make pages`; the devices read type, access, range and
default from the same files, so there is no second place where one of these could differ. An object that is
here acts: `tests/unit/eds/test_every_object_is_tried.py` asks for a test of each.

Range: what the EDS allows; no range is the whole range of the type. Some objects refuse more, by the state of
the device or the hardware of the axis. Default: a value from the hardware of the machine has none in the EDS.
PDO: r may be received, t transmitted. Access rww is a command or a set point: 1010h does not store it.

Holding brake, rotary axis and largest motor speed: [states of the drive](drive_states.md#the-holding-brake).
Not there: 1023h, as these devices have no command interface; 60EAh, the commutation angle that a controller
commands in mode 11 (CSTCA; Beckhoff, *AX8000 object dictionary*, 0x60EA), as this drive commutates by its own
encoder and announces no mode 11 in 6502h; 60EFh, of which no public manual or EDS was found.
"""


class Row(NamedTuple):
    """One line: an object, or subindices that differ in nothing but their number."""

    index: str
    subindex: int | None
    name: str
    cells: tuple[str, ...]
    """Type, access, range, default, PDO."""


def page(drive: Path, scale: Path) -> str:
    """The whole document."""
    parts = [INTRODUCTION]
    for title, eds, first, last in (
        ("Drive: communication (CiA 301)", drive, 0x1000, 0x1FFF),
        ("Drive: of its own", drive, 0x2000, 0x5FFF),
        ("Drive: profile (CiA 402)", drive, 0x6000, 0x67FF),
        ("Scale: communication (CiA 301)", scale, 0x1000, 0x1FFF),
        ("Scale: of its own", scale, 0x2000, 0x5FFF),
        ("Scale: profile (CiA 406)", scale, 0x6000, 0x67FF),
    ):
        lines = [line for index, line in _lines(eds) if first <= index <= last]
        head = "| object | name | type | access | range | default | PDO |\n|---|---|---|---|---|---|---|\n"
        parts.append(f"\n## {title}\n\n{head}" + "".join(f"{line}\n" for line in lines))
    return "".join(parts)


def _lines(eds: Path) -> Iterator[tuple[int, str]]:
    for (index, _), group in groupby(_rows(eds), key=lambda row: (row.index, _kind(row))):
        rows = list(group)
        first, last = rows[0], rows[-1]
        address = f"`{index}h`"
        if first.subindex is not None:
            address = f"`{index}h:{first.subindex:02X}`"
            address += f" ... `{last.subindex:02X}`" if len(rows) > 1 else ""
        name = first.name if len(rows) == 1 else f"{first.name} ... {_number(last)}"
        yield int(index, 16), "| " + " | ".join((address, name, *first.cells)) + " |"


def _kind(row: Row) -> tuple[str, ...]:
    """Rows of one kind make one line: the name without its number."""
    return (re.sub(r"\d+", "", row.name), *row.cells)


def _number(row: Row) -> str:
    found = re.findall(r"\d+", row.name)
    return found[-1] if found else row.name


def _rows(eds: Path) -> Iterator[Row]:
    parser = RawConfigParser()
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # keys keep their case
    parser.read_string(eds.read_text(encoding="ascii"))
    objects = sorted(section for section in parser.sections() if re.fullmatch("[0-9A-F]{4}", section))
    for index in objects:
        title = parser[index]["ParameterName"]
        members = [name for name in parser.sections() if re.fullmatch(f"{index}sub[0-9A-F]+", name)]
        if not members:
            yield Row(index, None, title, _cells(parser[index]))
        for member in members:
            subindex = int(member.split("sub")[1], 16)
            if subindex or parser[member]["AccessType"] != "const":  # how many there are is seen
                yield Row(
                    index, subindex, f"{title}: {parser[member]['ParameterName']}", _cells(parser[member])
                )


def _cells(entry: SectionProxy) -> tuple[str, ...]:
    low, high = entry.get("LowLimit", ""), entry.get("HighLimit", "")
    directions = ""
    if entry["PDOMapping"] == "1":
        directions = "r" * (entry["AccessType"] in RECEIVED) + "t" * (entry["AccessType"] in SENT)
    return (
        TYPES[int(entry["DataType"], 0)],
        entry["AccessType"],
        f"{low} to {high}" if low or high else "",
        entry.get("DefaultValue", "").replace("$NODEID", "node id"),
        directions,
    )
