"""Generates, from the declarations, the objects of eds/servo_ctrl.eds and the tables of docs/commands.md.

Run `python -m servo_ctrl.commands.tables [REPOSITORY]`; a test compares both files with its output.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.eds_sections import COMMANDS, Objects, objects, own_sections
from servo_ctrl.commands.field import AXES, Entry, Field, PerAxis, topic_unit
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.status_fields import status_fields

DOCUMENT, EDS = Path("docs/commands.md"), Path("eds/servo_ctrl.eds")


def main() -> None:
    """Write both files in the repository given as argument, or in the present directory."""
    for path, text in files(Path(*sys.argv[1:2])).items():
        path.write_text(text, encoding="utf-8")


def files(repository: Path) -> dict[Path, str]:
    """Return the generated contents of both files by path."""
    found = objects()
    given = {index: fields for index, fields in found.items() if index in COMMANDS}
    status = {index: fields for index, fields in found.items() if index not in COMMANDS}
    page = (repository / DOCUMENT).read_text(encoding="utf-8")
    for name, rows in (("commands", _rows(given)), ("status", _rows(status)), ("fields", _names())):
        table = "".join("".join(f"| {cell} " if cell else "| " for cell in row) + "|\n" for row in rows)
        start, head, rest = re.split(rf"(<!-- {name}: made by commands\.tables -->\n.*\n.*\n)", page)
        page = f"{start}{head}{table}{rest[rest.index('<!-- end -->') :]}"
    eds = (repository / EDS).read_text(encoding="ascii")
    return {
        repository / DOCUMENT: page,
        repository / EDS: f"{eds[: eds.index('[1A00]')].rstrip()}\n{own_sections(AXES)}",
    }


def _rows(found: Objects) -> Iterator[tuple[str, ...]]:
    """Yield address, name, type, access, range and meaning of each object."""
    for index, fields in found.items():
        for subindex, field in fields.items():
            entry = field.entry
            if entry is None:
                continue
            address, name = f"`{index:04X}h`", field.title
            if entry.axis is PerAxis.SUBINDEX:
                yield f"`{index:04X}h:00`", "Highest sub-index supported", "u8", "ro", "", "Number of axes."
                address, name = f"`{index:04X}h:01` ... `{AXES:02X}`", f"{name} axis 1 ... {AXES}"
            elif entry.axis is PerAxis.INDEX:
                last = index + AXES - 1
                address = f"`{index:04X}h:{subindex:02X}` ... `{last:04X}h:{subindex:02X}`"
            elif subindex:
                address = f"`{index:04X}h:{subindex:02X}`"
            access = "rw" if entry.writable else "ro"
            limits = "" if entry.high is None else f"{entry.low} to {entry.high}"
            yield address, name, entry.data_type.name.lower(), access, limits, field.meaning


def _names() -> Iterator[tuple[str, ...]]:
    """Yield the names of each status field; in brackets if it is not on the local socket."""
    for kind, place in ((MachineStatus, ""), (AxisStatus, "axis.NAME.")):
        for path, field, _hint, rows in status_fields(kind):
            if rows or path == ("axes",):
                continue
            key = field.mqtt or topic_unit(path[-1])[0]
            mqtt = "" if field.mqtt is None else f"`{place}{'.'.join((*path[:-1], key))}`"
            local = f"`{place}{'.'.join(path)}`" if field.local else f"(`{place}{'.'.join(path)}`)"
            yield local, mqtt, _address(field), field.label


def _address(field: Field) -> str:
    entry: Entry | None = field.entry
    if entry is None:
        return ""
    subindex = "nn" if entry.axis is PerAxis.SUBINDEX else f"{entry.subindex:02X}"
    return f"`{entry.index:04X}h:{subindex}`"


if __name__ == "__main__":
    main()
