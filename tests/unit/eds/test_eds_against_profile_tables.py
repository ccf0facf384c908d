"""Every object of the drive and the scale against a table written from the profiles: type, access, mapping.

Columns: index:subindex, type, access, mappable into "r"eceive or "t"ransmit PDOs ("-" not at all). The rows
are those of nine real drives' EDS files ("all", "most") and of the cyclic and dual-loop modes. Set points and
commands are outputs of the master (`rww` in CiA 306), so only it sends them.
"""

from functools import cache
from pathlib import Path
from typing import Any

import canopen
import pytest

EDS = Path(__file__).parents[3] / "eds"
TYPES = {"i8": 2, "i16": 3, "i32": 4, "u8": 5, "u16": 6, "u32": 7, "str": 9}
NODE_ID = 7

COMMUNICATION = """
1000 u32 ro -,   1001 u8 ro t,    1003:0 u8 rw -,  1003:1 u32 ro -,  1005 u32 rw -,   1006 u32 rw -
1008 str ro -,   1009 str ro -,   100A str ro -,   1010:1 u32 rw -,  1010:2 u32 rw -, 1010:3 u32 rw -
1011:1 u32 rw -, 1011:2 u32 rw -, 1011:3 u32 rw -, 1014 u32 rw -,    1015 u16 rw -,   1016:1 u32 rw -
1017 u16 rw -,   1018:1 u32 ro -, 1018:2 u32 ro -, 1018:3 u32 ro -,  1018:4 u32 ro -, 1029:1 u8 rw -
1200:1 u32 ro -, 1200:2 u32 ro -
1800:1 u32 rw -, 1800:2 u8 rw -,  1800:3 u16 rw -, 1800:5 u16 rw -,  1A00:0 u8 rw -,  1A00:1 u32 rw -
1A00:8 u32 rw -
"""
DRIVE_ALL = """
1400:1 u32 rw -, 1400:2 u8 rw -,  1400:5 u16 rw -, 1600:0 u8 rw -,   1600:1 u32 rw -, 1600:8 u32 rw -
6040 u16 rw r,  6041 u16 ro t,   6060 i8 rw r,   6061 i8 ro t,     6062 i32 ro t,   6064 i32 ro t
606C i32 ro t,   607A i32 rw r,  607D:1 i32 rw rt, 607D:2 i32 rw rt, 6081 u32 rw rt, 6083 u32 rw rt
6098 i8 rw rt,   6502 u32 ro -
"""
DRIVE_MOST = """
6065 u32 rw rt,  6067 u32 rw rt,  6068 u16 rw rt,  606B i32 ro t,    607C i32 rw rt,  6084 u32 rw rt
6085 u32 rw rt,  6099:1 u32 rw rt, 6099:2 u32 rw rt, 609A u32 rw rt, 60C2:1 u8 rw -,  60C2:2 i8 rw -
60FD u32 ro t,   60FF i32 rw r,  603F u16 ro t,   605A i16 rw -,    605B i16 rw -,   605C i16 rw -
605E i16 rw -,   6007 i16 rw -,   6066 u16 rw rt,  6071 i16 rw r,   6076 u32 ro t,   6077 i16 ro t
6078 i16 ro t,   607E u8 rw -,    607F u32 rw rt,  608F:1 u32 ro -,  608F:2 u32 ro -, 60C5 u32 rw rt
60F4 i32 ro t
"""
DRIVE_CYCLIC = """
605D i16 rw -,   6072 u16 rw rt,  6074 i16 ro t,   6091:1 u32 ro -,  6091:2 u32 ro -, 6092:1 u32 ro -
6092:2 u32 ro -, 60B0 i32 rw r,  60B1 i32 rw r,  60B2 i16 rw r,   60E4:1 i32 ro t, 60E5:1 i32 ro t
60FC i32 ro t
"""
SCALE = """
6000 u16 rw -,   6002 u32 rw -,   6003 i32 rw -,   6004 i32 ro t,    6005:1 u32 ro -, 6005:2 u32 ro -
6010:1 i32 rw -, 6020:1 i32 ro t, 6030:1 i16 ro t, 6200 u16 rw -,    6500 u16 ro -,   6501 u32 ro -
6503 u16 ro t,   6504 u16 ro -,   6505 u16 ro t,   6506 u16 ro -,    6507 u32 ro -,   6509 i32 ro -
650A:1 i32 ro -, 650A:2 i32 ro -, 650A:3 i32 ro -, 650B u32 ro -
"""


@cache
def objects_of(name: str) -> canopen.ObjectDictionary:
    """The library reads a data sheet in a tenth of a second."""
    return canopen.import_od(str(EDS / name), NODE_ID)


def rows(*tables: str) -> list[str]:
    return [" ".join(row.split()) for table in tables for row in table.replace("\n", ",").split(",") if row]


def described(variable: Any) -> str:
    """A variable of the EDS as a row: `const` reads as `ro`, `rww` and `rwr` as `rw`."""
    access = {"const": "ro", "rww": "rw", "rwr": "rw"}.get(variable.access_type, variable.access_type)
    mapping = "-"
    if variable.pdo_mappable:
        received = variable.access_type in {"rw", "rww", "wo"}
        sent = variable.access_type in {"ro", "rw", "rwr", "const"}
        mapping = "r" * received + "t" * sent
    kind = next((name for name, number in TYPES.items() if number == variable.data_type), "?")
    return f"{kind} {access} {mapping}"


@pytest.mark.parametrize(
    ("name", "row"),
    [
        *(("servo_drive.eds", row) for row in rows(COMMUNICATION, DRIVE_ALL, DRIVE_MOST, DRIVE_CYCLIC)),
        *(("linear_scale.eds", row) for row in rows(COMMUNICATION, SCALE)),
    ],
)
def test_object_agrees_with_the_profile(name: str, row: str) -> None:
    address, expected = row.split(" ", 1)
    index, _, subindex = address.partition(":")
    dictionary = objects_of(name)
    variable = dictionary.get_variable(int(index, 16), int(subindex or "0"))
    assert variable is not None, f"{address} is missing"
    assert described(variable) == expected
