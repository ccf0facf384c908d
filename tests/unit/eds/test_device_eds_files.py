"""The EDS files of drive and scale: CiA 306, canopen, identifiers, and the process objects they describe."""

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
        ("[6064]\n", "[605F]\n", "6064 is listed but not described"),
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


def test_identifiers_follow_the_predefined_connection_set() -> None:
    dictionary = load("servo_drive.eds")
    assert [dictionary[0x1400 + n][1].default & 0x7FF for n in range(4)] == [0x205, 0x305, 0x405, 0x505]
    assert [dictionary[0x1800 + n][1].default & 0x7FF for n in range(4)] == [0x185, 0x285, 0x385, 0x485]
    assert dictionary[0x1014].default == 0x85
    assert (dictionary[0x1200][1].default, dictionary[0x1200][2].default) == (0x605, 0x585)


def test_supported_modes_are_pp_pv_pt_hm_ip_csp_csv_cst() -> None:
    assert (
        load("servo_drive.eds")[0x6502].default
        == 1 << 0 | 1 << 2 | 1 << 3 | 1 << 5 | 1 << 6 | 1 << 7 | 1 << 8 | 1 << 9
    )


@pytest.mark.parametrize(
    ("name", "kind"), [("servo_drive.eds", DriveObjects), ("linear_scale.eds", ScaleObjects)]
)
def test_process_objects_are_named_as_in_the_eds(name: str, kind: type) -> None:
    dictionary = load(name)
    for (index, subindex), attribute in attribute_names(kind).items():
        name_in_eds = dictionary.get_variable(index, subindex).name
        object_name = name_in_eds.lower().replace(" ", "_").replace("-", "_")
        assert attribute in {object_name, object_name.removeprefix("1st_")}


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
