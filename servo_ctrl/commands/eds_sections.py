"""Generates the EDS sections (CiA 306) that follow from the declarations: status mapping, own objects."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from servo_ctrl.commands import controller_objects as o
from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.field import AXES, DataType, Entry, Field, PerAxis
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.status_fields import status_fields

Objects = Mapping[int, dict[int, Field]]

VAR, DOMAIN, ARRAY, RECORD = "0x7", "0x2", "0x8", "0x9"
COUNT = "Highest sub-index supported"
MAPPING, MAPPING_TITLE = 0x1A00, "TPDO mapping parameter 1"
MOST_MAPPED = 8
"""Objects that the status TPDO may map: a byte each."""
COMMANDS = range(0x2100, 0x2110)
"""Indices of the objects that take commands; the numbers of all others may be mapped."""


def objects() -> Objects:
    """Return every declared object by index and subindex; for objects of each axis, those of axis 1."""
    found: defaultdict[int, dict[int, Field]] = defaultdict(dict)
    declared = [each.field for kind in (MachineStatus, AxisStatus) for each in status_fields(kind)]
    for field in (*o.FIELDS, *declared):
        if field.entry is not None:
            found[field.entry.index][field.entry.subindex] = field
    return {index: dict(sorted(found[index].items())) for index in sorted(found)}


def own_sections(axes: int) -> str:
    """Return the EDS from 1A00h to its end, for a machine of so many axes."""
    found = objects()
    return "\n".join([*status_mapping(found), "", *eds_objects(found, axes)])


def eds_of(text: str, axes: int) -> str:
    """Return our EDS, written for `AXES` axes, as that of a machine with `axes`; another one unchanged."""
    return text.replace(own_sections(AXES), own_sections(min(axes, AXES)))


def status_mapping(objects: Objects) -> Iterator[str]:
    """Yield the lines of 1A00h: the fields mapped into the status TPDO."""
    entries = [field.entry for fields in objects.values() for field in fields.values() if field.entry]
    mapped = sorted((entry for entry in entries if entry.pdo), key=lambda entry: entry.pdo)
    yield from _section(MAPPING, None, MAPPING_TITLE, RECORD, SubNumber=str(MOST_MAPPED + 1))
    yield from _value(
        MAPPING, 0, "Number of mapped objects", data_type=DataType.U8, access="rw", default=str(len(mapped))
    )
    values = [entry.index << 16 | entry.subindex << 8 | entry.data_type.bits for entry in mapped]
    values += [0] * (MOST_MAPPED - len(values))
    for place, value in enumerate(values, start=1):
        yield from _value(
            MAPPING,
            place,
            f"Mapped object {place}",
            data_type=DataType.U32,
            access="rw",
            default=f"0x{value:08X}",
        )


def eds_objects(objects: Objects, axes: int) -> Iterator[str]:
    """Yield the lines from [ManufacturerObjects] to the end of the file."""
    sections = {
        index + number - 1: list(_object(index, fields, number, axes))
        for index, fields in objects.items()
        for number in (range(1, axes + 1) if _axis(fields) is PerAxis.INDEX else (1,))
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


def _object(index: int, fields: Mapping[int, Field], number: int, axes: int) -> Iterator[str]:
    """Yield the lines of an object, for axis `number` of `axes` if it repeats for each axis."""
    axis, place = _axis(fields), index + number - 1
    if axis is PerAxis.SUBINDEX:
        field = fields[0]
        yield from _section(index, None, o.RECORDS[index], ARRAY, SubNumber=str(axes + 1))
        yield from _value(index, 0, COUNT, data_type=DataType.U8, access="ro", default=str(axes))
        for element in range(1, axes + 1):
            yield from _entry(index, element, f"{field.title} axis {element}", field.entry)
        return
    if index not in o.RECORDS:
        yield from _entry(index, None, fields[0].title, fields[0].entry)
        return
    title = f"{o.RECORDS[index]} axis {number}" if axis is PerAxis.INDEX else o.RECORDS[index]
    yield from _section(place, None, title, RECORD, SubNumber=str(len(fields) + 1))
    yield from _value(place, 0, COUNT, data_type=DataType.U8, access="const", default=str(max(fields)))
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
    mapped = "1" if entry.data_type.bits and index not in COMMANDS else "0"
    yield from _value(
        index,
        subindex,
        title,
        data_type=entry.data_type,
        access=access,
        default=text,
        limits=limits,
        mapping=mapped,
    )


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
