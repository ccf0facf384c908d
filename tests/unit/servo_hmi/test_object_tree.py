"""The object browser: entries of an EDS, and which of them may be written."""

import subprocess
import sys
from pathlib import Path

import canopen
import pytest

from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.commands.local_messages import LocalRequest
from servo_ctrl.hmi.bus.object_tree import ObjectEntry, load_entries, tree_nodes
from servo_ctrl.hmi.bus.object_values import parse_value, request_value, value_text

EDS = Path(__file__).parents[3] / "eds"
WHO = {"user": "ada", "role": "configure", "address": ""}


def entry_of(
    type_code: int, *, access: str = "rw", low: int | None = None, high: int | None = None
) -> ObjectEntry:
    return ObjectEntry(0x2000, 0, "object", type_code, access, low=low, high=high)


@pytest.mark.parametrize("name", ["servo_drive.eds", "linear_scale.eds", "servo_ctrl.eds"])
def test_every_entry_of_the_file_is_in_the_tree_once_and_in_its_range(name: str) -> None:
    entries = load_entries(EDS / name, 5)
    found = [(entry.index, entry.subindex) for entry in entries]
    dictionary = canopen.import_od(str(EDS / name), 5)
    expected = [
        (variable.index, variable.subindex)
        for source in dictionary.values()
        for variable in (
            [source] if isinstance(source, canopen.objectdictionary.ODVariable) else source.values()
        )
        if variable.index >= 0x1000
    ]
    assert sorted(found) == sorted(expected)
    assert len(found) == len(set(found))
    for part in tree_nodes(entries):
        if part["id"] == "Device profile":
            assert all("6000" <= one["id"][:4] <= "9FFF" for one in part["children"])


def test_an_entry_has_name_type_access_limits_and_the_default_of_its_node() -> None:
    entries = {entry.address: entry for entry in load_entries(EDS / "servo_drive.eds", 5)}
    quick_stop = entries["605A:00"]
    assert (quick_stop.name, quick_stop.type_name, quick_stop.access) == (
        "Quick stop option code",
        "INTEGER16",
        "rw",
    )
    assert quick_stop.limits == (0, 8)
    assert entries["1014:00"].default == str(0x80 + 5)
    assert not entries["6041:00"].writable
    assert entries["6040:00"].writable


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\x00\xff",
        "[1000]\nParameterName=x\n",
        "[DeviceInfo]\n[FileInfo\n",
        "[DeviceInfo]\n[1000]\nParameterName=x\n",
        "[DeviceInfo]\n[6040sub1]\nParameterName=a\nDataType=5\nAccessType=rw\n",
    ],
)
def test_a_file_that_is_no_eds_is_refused_by_its_name(tmp_path: Path, text: str) -> None:
    file = tmp_path / "broken.eds"
    file.write_text(text, encoding="latin-1")
    with pytest.raises(EdsError, match=r"broken\.eds"):
        load_entries(file, 1)


def test_a_missing_eds_is_refused() -> None:
    with pytest.raises(EdsError, match="no such EDS"):
        load_entries(Path("nowhere.eds"), 1)


@pytest.mark.parametrize(
    ("type_code", "text", "value"),
    [
        (0x1, "1", 1),
        (0x2, "-128", -128),
        (0x5, "0xFF", 255),
        (0x3, " -2 ", -2),
        (0x6, "1Fh", 31),
        (0x4, "-70000", -70000),
        (0x7, "4294967295", 4294967295),
        (0x1B, "18446744073709551615", (1 << 64) - 1),
        (0x8, "0.25", 0.25),
        (0x11, "-1e300", -1e300),
        (0x9, "abc", "abc"),
        (0xB, "ab", "61006200"),
        (0xA, "01 a0:FF", "01a0ff"),
        (0x10, "-2", "feffff"),
        (0x16, "5", "050000"),
    ],
)
def test_a_typed_value_becomes_a_request_value(type_code: int, text: str, value: float | str) -> None:
    entry = entry_of(type_code)
    sent = request_value(entry, parse_value(entry, text))
    assert sent == value
    LocalRequest.model_validate({"id": 1, "who": WHO, "do": "write_object", "value": sent})


@pytest.mark.parametrize(
    ("entry", "text", "reason"),
    [
        (entry_of(0x5), "256", "outside 0 ... 255"),
        (entry_of(0x5), "-1", "outside"),
        (entry_of(0x5), "1.5", "whole number"),
        (entry_of(0x5), "", "whole number"),
        (entry_of(0x3, low=0, high=8), "9", "outside 0 ... 8"),
        (entry_of(0x3, high=1 << 20), "32768", "outside -32768 ... 32767"),
        (entry_of(0x8), "nan", "NaN"),
        (entry_of(0x8), "1e39", "beyond REAL32"),
        (entry_of(0x8), "x", "number"),
        (entry_of(0x9), "é", "ASCII"),
        (entry_of(0x9), "a\nb", "ASCII"),
        (entry_of(0x9), "a" * 1001, "1000"),
        (entry_of(0xA), "0", "two digits"),
        (entry_of(0xF), "xy", "hex"),
        (entry_of(0xF), "00" * 1001, "1000 bytes"),
        (entry_of(0x5, access="ro"), "1", "cannot be written"),
        (entry_of(0x5, access="const"), "1", "cannot be written"),
    ],
)
def test_an_invalid_value_is_refused_before_it_is_sent(entry: ObjectEntry, text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        parse_value(entry, text)


@pytest.mark.parametrize(
    ("type_code", "value", "text"),
    [
        (0x6, 0x1637, "5687 (1637h)"),
        (0x3, -2, "-2 (FFFEh)"),
        (0x1, 1, "1"),
        (0x9, "drive", "drive"),
        (0xA, "01a0", "01 A0"),
        (0xA, "", "(empty)"),
        (0x8, 0.5, "0.5"),
        (0x6, None, "-"),
        (0x10, "feffff", "-2 (FFFFFEh)"),
        (0x10, "fe", "fe"),
        (0x6, "no hex", "no hex"),
    ],
)
def test_a_value_is_shown_as_readable_text(type_code: int, value: int | str | None, text: str) -> None:
    assert value_text(entry_of(type_code), value) == text


def test_the_page_starts_without_the_libraries_that_only_one_card_needs() -> None:
    """A tree of objects needs canopen, a saved capture matplotlib; each takes 30 MB or more."""
    code = "import sys, servo_ctrl.hmi.app; print(*{'canopen', 'matplotlib', 'plotly'} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
