"""Copies of machine and plant files: texts replaced, sections removed, EDS paths absolute."""

import re
from collections.abc import Mapping
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
XY_TABLE = REPOSITORY / "machines" / "xy_table"


def text_of(source: Path, changes: Mapping[str, str] | None = None, *, occurrences: int = -1) -> str:
    """Return the text of a file with absolute EDS paths, and texts replaced by `replaced`."""
    text = source.read_text(encoding="utf-8").replace("../../eds", str(REPOSITORY / "eds"))
    return replaced(text, changes or {}, occurrences=occurrences)


def replaced(text: str, changes: Mapping[str, str], *, occurrences: int = -1) -> str:
    """Return the text with each key of `changes`, which must occur, replaced at most `occurrences` times."""
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new, occurrences)
    return text


def without_sections(text: str, *sections: str) -> str:
    """Return the text without these sections of its axes: [axis.NAME.SECTION]."""
    for section in sections:
        text = re.sub(rf"^\[axis\.\w+\.{section}\]\n(?:[^\[\n].*\n)*", "", text, flags=re.MULTILINE)
    return text


def write_controller(directory: Path, text: str) -> Path:
    """Write the text as controller.toml of a directory, created if necessary; return the file."""
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / "controller.toml"
    path.write_text(text, encoding="utf-8")
    return path


def write_plant(directory: Path, text: str) -> Path:
    """Write the text as plant.toml of a directory; return the file."""
    path = directory / "plant.toml"
    path.write_text(text, encoding="utf-8")
    return path


def plant_with(directory: Path, sections: str, machine: str = "xy_table") -> Path:
    """Write the plant file of a machine with more sections; return the file."""
    return write_plant(directory, text_of(XY_TABLE.parent / machine / "plant.toml") + sections)
