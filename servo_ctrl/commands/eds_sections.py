"""Generates the EDS sections (CiA 306) that follow from the declarations: status mapping, own objects."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from servo_ctrl.commands.controller_objects import RECORDS
from servo_ctrl.commands.field import AXES, DataType, Entry, Field, PerAxis

Objects = Mapping[int, dict[int, Field]]

VAR, DOMAIN, ARRAY, RECORD = "0x7", "0x2", "0x8", "0x9"
COUNT = "Highest sub-index supported"
MAPPING, MAPPING_TITLE = 0x1A00, "TPDO mapping parameter 1"


def status_mapping(objects: Objects) -> Iterator[str]:
    """Yield the lines of 1A00h: the fields mapped into the status TPDO."""
    entries = [field.entry for fields in objects.values() for field in fields.values() if field.entry]
    mapped = sorted((entry for entry in entries if entry.pdo), key=lambda entry: entry.pdo)
    yield from _section(MAPPING, None, MAPPING_TITLE, RECORD, SubNumber=str(len(mapped) + 1))
    yield from _value(MAPPING, 0, COUNT, DataType.U8, "const", str(len(mapped)))
    for place, entry in enumerate(mapped, start=1):
        value = entry.index << 16 | entry.subindex << 8 | entry.data_type.bits
        yield from _value(MAPPING, place, f"Mapped object {place}", DataType.U32, "const", f"0x{value:08X}")


def eds_objects(objects: Objects) -> Iterator[str]:
    """Yield the lines from [ManufacturerObjects] to the end of the file."""
    sections = {
        index + number - 1: list(_object(index, fields, number))
        for index, fields in objects.items()
        for number in (range(1, AXES + 1) if _axis(fields) is PerAxis.INDEX else (1,))
    }
    yield "[ManufacturerObjects]"
    yield f"SupportedObjects={len(sections)}"
    yield from (f"{place}=0x{index:04X}" for place, index in enumerate(sorted(sections), start=1))
    for index in sorted(sections):
        yield from sections[index]
    yield ""


def _axis(fields: Mapping[int, Field]) -> PerAxis:
    """Return how an object repeats for each axis; all its entries agree."""
    return next(field.entry.axis for field in fields.values() if field.entry is not None)


def _object(index: int, fields: Mapping[int, Field], number: int) -> Iterator[str]:
    """Yield the lines of an object, for axis `number` if it repeats for each axis."""
    axis, place = _axis(fields), index + number - 1
    if axis is PerAxis.SUBINDEX:
        field = fields[0]
        yield from _section(index, None, RECORDS[index], ARRAY, SubNumber=str(AXES + 1))
        yield from _value(index, 0, COUNT, DataType.U8, "ro", str(AXES))
        for element in range(1, AXES + 1):
            yield from _entry(index, element, f"{field.title} axis {element}", field.entry)
        return
    if index not in RECORDS:
        yield from _entry(index, None, fields[0].title, fields[0].entry)
        return
    title = f"{RECORDS[index]} axis {number}" if axis is PerAxis.INDEX else RECORDS[index]
    yield from _section(place, None, title, RECORD, SubNumber=str(len(fields) + 1))
    yield from _value(place, 0, COUNT, DataType.U8, "const", str(max(fields)))
    for subindex, field in fields.items():
        yield from _entry(place, subindex, field.title, field.entry)


def _entry(index: int, subindex: int | None, title: str, entry: Entry | None) -> Iterator[str]:
    if entry is None:
        return
    access = "rw" if entry.writable else "ro"
    if entry.data_type is DataType.TABLE:
        keys = {"DataType": "0x000F", "AccessType": access, "PDOMapping": "0"}
        yield from _section(index, subindex, title, DOMAIN, **keys)
        return
    default = entry.default if entry.default is not None else entry.absent
    text = f"0x{default:X}" if default == (1 << entry.data_type.bits) - 1 else str(default)
    text = "" if entry.data_type is DataType.TEXT else text
    bounds = {"LowLimit": entry.low, "HighLimit": entry.high}
    limits = {key: str(bound) for key, bound in bounds.items() if bound is not None}
    yield from _value(index, subindex, title, entry.data_type, access, text, limits, str(int(entry.pdo > 0)))


def _value(
    index: int,
    subindex: int | None,
    title: str,
    data_type: DataType,
    access: str,
    default: str,
    limits: Mapping[str, str] = MappingProxyType({}),
    mapping: str = "0",
) -> Iterator[str]:
    keys = {"DataType": f"0x{data_type:04X}", "AccessType": access, **limits}
    yield from _section(index, subindex, title, VAR, **keys, DefaultValue=default, PDOMapping=mapping)


def _section(index: int, subindex: int | None, title: str, kind: str, **keys: str) -> Iterator[str]:
    """Yield a section and the empty line before it."""
    name = f"{index:04X}" if subindex is None else f"{index:04X}sub{subindex:X}"
    yield from ("", f"[{name}]", f"ParameterName={title}", f"ObjectType={kind}")
    yield from (f"{key}={value}" for key, value in keys.items())
