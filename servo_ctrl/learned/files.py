"""Reads and writes single files of the store: a version, and the file that names the version in use.

Reading raises OSError, or ValueError with the reason; writing raises OSError.
"""

import json
import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, Strict, ValidationError

from servo_ctrl.config.file_format import format_problem
from servo_ctrl.config.section import FileSection
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.learned.file_model import CONDITION_CHARACTERS_MAX, LearnedFile

File = TypeVar("File", bound="LearnedFile[Any]")

ACTIVE_FILE = "active.json"
FILE_CHARACTERS_MAX = 1_000_000
"""Bounds the characters of a file; chosen: pulse functions have a few thousand, a screw 150 a node."""
_VERSION_FILE = re.compile(r"v([0-9]{4,6})\.json")


class Active(FileSection):
    """The content of active.json."""

    format: Literal[1] = 1
    version: Annotated[int, Strict(), Field(ge=0)] = 0
    """The version in use; 0 = none."""
    sha256: str = ""
    """Checksum of that version, which detects another file under its name."""


def version_path(directory: Path, number: int) -> Path:
    """Return the path of a version."""
    return directory / f"v{number:04d}.json"


def version_numbers(directory: Path) -> list[int]:
    """Return the numbers of all versions, intact or not, in rising order; empty without a directory."""
    try:
        names = [path.name for path in directory.iterdir()]
    except FileNotFoundError:
        return []
    return sorted(int(match[1]) for name in names if (match := _VERSION_FILE.fullmatch(name)))


def read_version(kind: type[File], directory: Path, number: int) -> File:
    """Read an intact version, without checking that it fits the machine."""
    result = kind.from_text(_text_of(version_path(directory, number)))
    if result.version != number:
        raise ValueError(f"holds version {result.version}: it was renamed or copied")
    return result


def write_version(directory: Path, result: LearnedFile[Any]) -> None:
    """Write a version; the caller ensures that its number is free."""
    write_text_whole(version_path(directory, result.version), result.to_text())


def read_active(directory: Path) -> Active:
    """Read which version is in use; version 0 without a file."""
    try:
        text = _text_of(directory / ACTIVE_FILE)
    except FileNotFoundError:
        return Active()
    try:
        if problem := format_problem(json.loads(text)["format"]):
            raise ValueError(problem)
    except (json.JSONDecodeError, RecursionError, KeyError, TypeError):
        raise ValueError("is damaged: it names no version") from None
    try:
        return Active.model_validate_json(text)
    except ValidationError:
        raise ValueError("is damaged: it names no version") from None


def write_active(directory: Path, result: LearnedFile[Any] | None) -> None:
    """Name the version in use, or none."""
    active = Active() if result is None else Active(version=result.version, sha256=result.sha256)
    write_text_whole(directory / ACTIVE_FILE, active.model_dump_json(indent=2) + "\n")


def _text_of(path: Path) -> str:
    with path.open(encoding="utf-8") as file:
        text = file.read(FILE_CHARACTERS_MAX + 1)
    if len(text) > FILE_CHARACTERS_MAX:
        raise ValueError(f"is damaged: it has more than {FILE_CHARACTERS_MAX} characters")
    return text


def json_scalar(value: Any) -> bool | float | str:
    """Convert a condition for JSON: values other than finite numbers and bool become text."""
    if isinstance(value, bool | int) or (isinstance(value, float) and math.isfinite(value)):
        return value
    return str(value)[:CONDITION_CHARACTERS_MAX]
