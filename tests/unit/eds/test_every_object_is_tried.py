"""An object that does nothing is a defect: a test of the devices names every one of drive and scale."""

import re
from functools import cache
from pathlib import Path

import pytest
from canopen import import_od

EDS = Path(__file__).parents[3] / "eds"
UNIT = Path(__file__).parents[1]
ROOMS = ("hil_sim_node", "hil_sim_drive", "hil_sim_scale", "eds")
BY_NUMBER = {
    *(0x1000, 0x1200),
    *(first + number for first in (0x1400, 0x1600, 0x1800, 0x1A00) for number in range(4)),
    *(first + number for first in (0x6310, 0x6320, 0x6330) for number in range(8)),
}
"""Tried by their number (PDOs, cams), and what every client asks for."""


@cache
def tried() -> frozenset[int]:
    """Objects that the tests write as 0x6040 or, in tables, as 6040h or 6040."""
    text = "".join(
        file.read_text(encoding="utf-8")
        for room in ROOMS
        for file in (UNIT / room).glob("test_*.py")
        if file.name != "test_eds_against_profile_tables.py"
    )
    return frozenset(int(word, 16) for word in re.findall(r"\b0x([0-9A-F]{4})\b", text))


@pytest.mark.parametrize("name", ["servo_drive.eds", "linear_scale.eds"])
def test_no_object_is_without_a_test(name: str) -> None:
    objects = {index for index in import_od(str(EDS / name), 1) if index >= 0x1000}
    assert sorted(f"{index:04X}h" for index in objects - tried() - BY_NUMBER) == []
