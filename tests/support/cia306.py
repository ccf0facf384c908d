"""A small checker of EDS files against CiA 306-1: sections, object lists, counts, types, PDO mappings.

It reads the file with configparser alone, so it shares nothing with canopen's importer.
"""

import re
import time
from configparser import RawConfigParser
from pathlib import Path

BITS = {0x1: 1, 0x2: 8, 0x3: 16, 0x4: 32, 0x5: 8, 0x6: 16, 0x7: 32, 0x8: 32, 0x15: 64, 0x1B: 64}
SIGNED = {0x2, 0x3, 0x4, 0x15}
OTHER_TYPES = {0x9, 0xA, 0xB, 0xF}  # strings and domain
ACCESS = {"ro", "wo", "rw", "rwr", "rww", "const"}
FILE_INFO = """
    FileName FileVersion FileRevision EDSVersion Description CreationTime CreationDate CreatedBy
    ModificationTime ModificationDate ModifiedBy
""".split()  # noqa: SIM905  # a list of words
DEVICE_INFO = """
    VendorName VendorNumber ProductName ProductNumber RevisionNumber OrderCode SimpleBootUpMaster
    SimpleBootUpSlave Granularity DynamicChannelsSupported GroupMessaging NrOfRXPDO NrOfTXPDO LSS_Supported
    BaudRate_10 BaudRate_20 BaudRate_50 BaudRate_125 BaudRate_250 BaudRate_500 BaudRate_800 BaudRate_1000
""".split()  # noqa: SIM905  # the same
LISTS = {
    "MandatoryObjects": lambda index: index in {0x1000, 0x1001, 0x1018},
    "OptionalObjects": lambda index: (
        (0x1000 <= index < 0x2000 or 0x6000 <= index < 0xA000) and index not in {0x1000, 0x1001, 0x1018}
    ),
    "ManufacturerObjects": lambda index: 0x2000 <= index < 0x6000,
}


def findings(path: Path) -> list[str]:
    """Return the violations in the file, one sentence each."""
    eds = RawConfigParser(strict=True)
    eds.optionxform = str
    eds.read_string(path.read_text(encoding="ascii"))
    found: list[str] = []
    found += missing_keys(eds, "FileInfo", FILE_INFO) + missing_keys(eds, "DeviceInfo", DEVICE_INFO)
    found += missing_keys(eds, "DummyUsage", [f"Dummy{number:04d}" for number in range(1, 8)])
    if eds["FileInfo"]["FileName"] != path.name:
        found.append("FileName is not the file's name")
    for key in ("Creation", "Modification"):
        time.strptime(eds["FileInfo"][f"{key}Time"], "%I:%M%p")
        time.strptime(eds["FileInfo"][f"{key}Date"], "%m-%d-%Y")
    lines = int(eds["Comments"]["Lines"])
    if sorted(eds["Comments"]) != sorted(["Lines", *(f"Line{n}" for n in range(1, lines + 1))]):
        found.append("Comments: Lines does not count the lines")
    listed = object_lists(eds, found)
    described = {int(name, 16) for name in eds.sections() if re.fullmatch("[0-9A-F]{4}", name)}
    found += [f"{index:04X} is listed but not described" for index in sorted(listed - described)]
    found += [f"{index:04X} is described but not listed" for index in sorted(described - listed)]
    known = set(LISTS) | {"FileInfo", "DeviceInfo", "DummyUsage", "Comments"}
    for name in eds.sections():
        if name not in known and not re.fullmatch("[0-9A-F]{4}(sub[0-9A-F]+)?", name):
            found.append(f"unknown section {name}")
    for index in sorted(described):
        found += object_findings(eds, index)
    found += pdo_findings(eds, described)
    return found


def missing_keys(eds: RawConfigParser, section: str, keys: list[str]) -> list[str]:
    if section not in eds:
        return [f"section {section} is missing"]
    return [f"{section}: {key} is missing" for key in keys if key not in eds[section]]


def object_lists(eds: RawConfigParser, found: list[str]) -> set[int]:
    listed: set[int] = set()
    for section, belongs in LISTS.items():
        entries = dict(eds[section])
        count = int(entries.pop("SupportedObjects"), 0)
        if sorted(entries, key=int) != [str(n) for n in range(1, count + 1)]:
            found.append(f"{section}: SupportedObjects does not count the entries")
        for value in entries.values():
            index = int(value, 0)
            if not belongs(index):
                found.append(f"{index:04X} does not belong into {section}")
            if index in listed:
                found.append(f"{index:04X} is listed twice")
            listed.add(index)
    return listed


def object_findings(eds: RawConfigParser, index: int) -> list[str]:
    name = f"{index:04X}"
    section = eds[name]
    found = missing_keys(eds, name, ["ParameterName", "ObjectType"])
    kind = int(section.get("ObjectType", "0"), 0)
    members = [s for s in eds.sections() if s.startswith(f"{name}sub")]
    if kind in {0x2, 0x7}:
        if members:
            found.append(f"{name} is not a record but has sub-indices")
        return found + value_findings(eds, name)
    if kind not in {0x8, 0x9}:
        return [*found, f"{name}: ObjectType {kind:#x}"]
    if int(section.get("SubNumber", "0"), 0) != len(members):
        found.append(f"{name}: SubNumber does not count the sub-indices")
    numbers = [int(member.split("sub")[1], 16) for member in members]
    if numbers != sorted(set(numbers)) or numbers[:1] != [0]:
        found.append(f"{name}: sub-indices out of order, or sub0 missing")
    for member in members:
        found += value_findings(eds, member)
    if int(eds[f"{name}sub0"]["DataType"], 0) != 0x5:
        found.append(f"{name}sub0 is not UNSIGNED8")
    highest = int(eds[f"{name}sub0"]["DefaultValue"], 0)
    if eds[f"{name}sub0"]["AccessType"] == "const" and highest != numbers[-1]:
        found.append(f"{name}sub0 is not the highest sub-index")
    types = {eds[member]["DataType"] for member in members[1:]}
    if kind == 0x8 and len(types) != 1:
        found.append(f"{name} is an array of several types")
    return found


def value_findings(eds: RawConfigParser, name: str) -> list[str]:
    section = eds[name]
    found = missing_keys(eds, name, ["ParameterName", "ObjectType", "DataType", "AccessType", "PDOMapping"])
    if found:
        return found
    if not 1 <= len(section["ParameterName"]) <= 241:
        found.append(f"{name}: ParameterName has {len(section['ParameterName'])} characters")
    if section["AccessType"] not in ACCESS:
        found.append(f"{name}: AccessType {section['AccessType']}")
    data_type = int(section["DataType"], 0)
    if data_type not in BITS and data_type not in OTHER_TYPES:
        found.append(f"{name}: DataType {data_type:#x}")
    if section["PDOMapping"] not in {"0", "1"}:
        found.append(f"{name}: PDOMapping {section['PDOMapping']}")
    if data_type not in BITS:
        return found
    low = limit(section.get("LowLimit", ""), data_type, -1)
    high = limit(section.get("HighLimit", ""), data_type, 1)
    default = section.get("DefaultValue", "").replace("$NODEID+", "")
    if default and not low <= int(default, 0) <= high:
        found.append(f"{name}: DefaultValue {default} is outside its limits")
    if low > high:
        found.append(f"{name}: LowLimit above HighLimit")
    return found


def limit(text: str, data_type: int, side: int) -> int:
    if text:
        return int(text, 0)
    bits = BITS[data_type]
    if data_type in SIGNED:
        return -(1 << bits - 1) if side < 0 else (1 << bits - 1) - 1
    return 0 if side < 0 else (1 << bits) - 1


def pdo_findings(eds: RawConfigParser, described: set[int]) -> list[str]:
    found: list[str] = []
    for first, key, received in ((0x1400, "NrOfRXPDO", True), (0x1800, "NrOfTXPDO", False)):
        present = [index for index in sorted(described) if first <= index < first + 0x200]
        if int(eds["DeviceInfo"][key], 0) != len(present):
            found.append(f"{key} does not count the PDOs")
        for index in present:
            if index + 0x200 not in described:
                found.append(f"{index:04X} has no mapping parameter")
                continue
            found += mapping_findings(eds, index + 0x200, received)
        orphans = {i for i in described if first + 0x200 <= i < first + 0x400} - {i + 0x200 for i in present}
        found += [f"{index:04X} has no communication parameter" for index in sorted(orphans)]
    return found


def mapping_findings(eds: RawConfigParser, index: int, received: bool) -> list[str]:
    found: list[str] = []
    total = 0
    for number in range(1, int(eds[f"{index:04X}sub0"]["DefaultValue"], 0) + 1):
        entry = int(eds[f"{index:04X}sub{number:X}"]["DefaultValue"], 0)
        mapped, subindex, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
        record = f"{mapped:04X}sub{subindex:X}"
        name = record if record in eds else f"{mapped:04X}"
        if name not in eds:
            found.append(f"{index:04X}sub{number:X} maps {mapped:04X}, which is not there")
            continue
        section = eds[name]
        total += bits
        if section["PDOMapping"] != "1":
            found.append(f"{name} is mapped but cannot be")
        if section["AccessType"] not in ({"rww", "rw", "wo"} if received else {"ro", "rw", "rwr", "const"}):
            found.append(f"{name} is mapped into the wrong direction")
        if BITS[int(section["DataType"], 0)] != bits:
            found.append(f"{index:04X}sub{number:X} has the wrong length")
    if total > 64:
        found.append(f"{index:04X} maps {total} bits")
    return found
