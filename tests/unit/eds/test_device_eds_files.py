"""The EDS files of drive and scale: CiA 306, canopen, and the objects the bench promises."""

from __future__ import annotations

import re
from pathlib import Path

import canopen
import pytest
from cia306 import findings

from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.node.process_objects import attribute_names
from hil_sim.scale.scale_objects import ScaleObjects

EDS = Path(__file__).parents[3] / "eds"
FILES = ["servo_drive.eds", "linear_scale.eds"]

COMMUNICATION = [
    *(0x1000, 0x1001, 0x1003, 0x1005, 0x1006, 0x1008, 0x1009, 0x100A, 0x1010, 0x1011, 0x1014, 0x1016, 0x1017),
    *(0x1018, 0x1029, 0x1200, 0x1800, 0x1A00),
]
DRIVE_CORE = [0x6040, 0x6041, 0x6060, 0x6061, 0x6062, 0x6064, 0x606C, 0x607A, 0x607D, 0x6081, 0x6083]
DRIVE_CORE += [0x6098, 0x6502, 0x1400, 0x1600]
DRIVE_MOST = [
    *(0x6065, 0x6067, 0x6068, 0x606B, 0x607C, 0x6084, 0x6085, 0x6099, 0x609A, 0x60C2, 0x60FD, 0x60FF, 0x603F),
    *(0x605A, 0x605B, 0x605C, 0x605E, 0x6007, 0x6066, 0x6071, 0x6076, 0x6077, 0x6078, 0x607E, 0x607F, 0x608F),
    *(0x60C5, 0x60F4),
]
DRIVE_CYCLIC = [0x605D, 0x6072, 0x6074, 0x6091, 0x6092, 0x60B0, 0x60B1, 0x60B2, 0x60E4, 0x60E5, 0x60FC]
SCALE = [
    *(0x6000, 0x6002, 0x6003, 0x6004, 0x6005, 0x6010, 0x6020, 0x6030, 0x6200, 0x6500, 0x6501, 0x6503, 0x6504),
    *(0x6505, 0x6506, 0x6507, 0x6509, 0x650A, 0x650B),
]
I8, I16, I32, U8, U16, U32 = 2, 3, 4, 5, 6, 7
DRIVE_TYPES = {
    (0x1000, 0): U32,
    (0x1017, 0): U16,
    (0x6040, 0): U16,
    (0x6041, 0): U16,
    (0x6060, 0): I8,
    (0x6061, 0): I8,
    (0x6064, 0): I32,
    (0x606C, 0): I32,
    (0x607A, 0): I32,
    (0x607D, 1): I32,
    (0x607D, 2): I32,
    (0x6081, 0): U32,
    (0x6098, 0): I8,
    (0x6502, 0): U32,
    (0x6068, 0): U16,
    (0x60C2, 1): U8,
    (0x60C2, 2): I8,
    (0x60FD, 0): U32,
    (0x603F, 0): U16,
    (0x605A, 0): I16,
    (0x6007, 0): I16,
    (0x6071, 0): I16,
    (0x6072, 0): U16,
    (0x6076, 0): U32,
    (0x6078, 0): I16,
    (0x607E, 0): U8,
    (0x60B1, 0): I32,
    (0x60B2, 0): I16,
    (0x60E4, 1): I32,
    (0x60F4, 0): I32,
}


def load(name: str) -> canopen.ObjectDictionary:
    return canopen.import_od(str(EDS / name), 5)


@pytest.mark.parametrize("name", FILES)
def test_file_is_clean_under_cia_306(name: str) -> None:
    assert findings(EDS / name) == []


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("SupportedObjects=3\n1=0x1000", "SupportedObjects=4\n1=0x1000", "does not count the entries"),
        ("NrOfTXPDO=4", "NrOfTXPDO=3", "NrOfTXPDO does not count"),
        ("[6064]\n", "[6063]\n", "6064 is listed but not described"),
        ("0x60410010", "0x60410020", "wrong length"),
        ("0x60410010", "0x60400010", "wrong direction"),
        ("0x60410010", "0x60980008", "is mapped but cannot be"),
        ("SubNumber=9\n", "SubNumber=8\n", "SubNumber does not count"),
        ("AccessType=rww", "AccessType=xx", "AccessType xx"),
        (
            "HighLimit=8\nDefaultValue=2\nPDOMapping=0",
            "HighLimit=1\nDefaultValue=2\nPDOMapping=0",
            "outside its limits",
        ),
    ],
)
def test_checker_finds_what_is_wrong(tmp_path: Path, old: str, new: str, expected: str) -> None:
    text = (EDS / "servo_drive.eds").read_text(encoding="ascii")
    if old == "0x60410010" and new == "0x60980008":
        text = re.sub(r"(\[6098\].*?PDOMapping=)1", r"\g<1>0", text, count=1, flags=re.DOTALL)
    assert old in text
    spoilt = tmp_path / "servo_drive.eds"
    spoilt.write_text(text.replace(old, new, 1), encoding="ascii")
    assert any(expected in finding for finding in findings(spoilt)), findings(spoilt)


def test_drive_has_the_objects_of_real_drives() -> None:
    dictionary = load("servo_drive.eds")
    missing = [
        f"{index:04X}"
        for index in COMMUNICATION + DRIVE_CORE + DRIVE_MOST + DRIVE_CYCLIC
        if index not in dictionary
    ]
    assert missing == []


def test_scale_has_the_objects_of_cia_406() -> None:
    dictionary = load("linear_scale.eds")
    assert [f"{index:04X}" for index in COMMUNICATION + SCALE if index not in dictionary] == []


@pytest.mark.parametrize(("address", "data_type"), DRIVE_TYPES.items())
def test_drive_objects_have_the_types_of_cia_402(address: tuple[int, int], data_type: int) -> None:
    index, subindex = address
    assert load("servo_drive.eds").get_variable(index, subindex).data_type == data_type


def test_identifiers_follow_the_predefined_connection_set() -> None:
    dictionary = load("servo_drive.eds")
    assert [dictionary[0x1400 + n][1].default & 0x7FF for n in range(4)] == [0x205, 0x305, 0x405, 0x505]
    assert [dictionary[0x1800 + n][1].default & 0x7FF for n in range(4)] == [0x185, 0x285, 0x385, 0x485]
    assert dictionary[0x1014].default == 0x85
    assert (dictionary[0x1200][1].default, dictionary[0x1200][2].default) == (0x605, 0x585)


def test_supported_modes_are_pp_pv_hm_csp_csv_cst() -> None:
    assert load("servo_drive.eds")[0x6502].default == 1 << 0 | 1 << 2 | 1 << 5 | 1 << 7 | 1 << 8 | 1 << 9


@pytest.mark.parametrize(
    ("name", "kind"), [("servo_drive.eds", DriveObjects), ("linear_scale.eds", ScaleObjects)]
)
def test_process_objects_are_named_as_in_the_eds(name: str, kind: type) -> None:
    dictionary = load(name)
    for (index, subindex), attribute in attribute_names(kind).items():
        spoken = dictionary.get_variable(index, subindex).name.lower().replace(" ", "_").replace("-", "_")
        said = attribute.removeprefix("gear_").removeprefix("feed_")  # 6091h and 6092h share names of members
        assert said in {spoken, spoken.removeprefix("1st_"), spoken.removeprefix("feed_")}


@pytest.mark.parametrize(
    ("name", "kind"), [("servo_drive.eds", DriveObjects), ("linear_scale.eds", ScaleObjects)]
)
def test_everything_that_can_be_mapped_is_a_process_object(name: str, kind: type) -> None:
    dictionary = load(name)
    held = set(attribute_names(kind))
    for index in dictionary:
        entry = dictionary[index]
        members = [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values()
        for variable in members:
            if variable.pdo_mappable and index > 0x20:
                assert (index, variable.subindex) in held, f"{index:04X}:{variable.subindex:02X}"
