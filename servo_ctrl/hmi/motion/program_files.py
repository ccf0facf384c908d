"""The programs directory of the machine: lists, reads and saves programs."""

import re
from pathlib import Path

from servo_ctrl.config.part_program import SUFFIXES
from servo_ctrl.errors import ConfigError
from servo_ctrl.files.whole_file import write_text_whole

MAX_PROGRAM_BYTES = 1 << 20
"""Bounds what is sent to a browser's editor."""
MAX_PROGRAMS = 500
"""Bounds the list that a browser gets."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,79}")


def programs_in(directory: Path) -> list[str]:
    """The names of the programs, sorted; none where there is no such directory."""
    try:
        found = [entry.name for entry in directory.iterdir() if _is_program(entry.name) and entry.is_file()]
    except OSError:
        return []
    return sorted(found)[:MAX_PROGRAMS]


def read_program(directory: Path, name: str) -> str:
    """Read the text of a program. Raises ConfigError."""
    path = _path(directory, name)
    try:
        if path.stat().st_size > MAX_PROGRAM_BYTES:
            raise ConfigError(name, "", f"is larger than the {MAX_PROGRAM_BYTES} bytes that this page edits")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(name, "", f"cannot be read: {error}") from None


def save_program(directory: Path, name: str, text: str) -> None:
    """Write a program whole or not at all, in place of one of the same name. Raises ConfigError."""
    path = _path(directory, name)
    if len(text.encode("utf-8", "surrogatepass")) > MAX_PROGRAM_BYTES:
        raise ConfigError(name, "", f"is larger than {MAX_PROGRAM_BYTES} bytes")
    try:
        directory.mkdir(exist_ok=True)
        write_text_whole(path, text)
    except (OSError, UnicodeEncodeError) as error:
        raise ConfigError(name, "", f"cannot be written: {error}") from None


def _path(directory: Path, name: str) -> Path:
    if not NAME.fullmatch(name) or not _is_program(name):
        endings = ", ".join([".toml", *sorted(SUFFIXES)])
        raise ConfigError(
            name,
            "",
            f"is no name for a program: letters, digits, space, _ - and ., ending in one of {endings}",
        )
    return directory / name


def _is_program(name: str) -> bool:
    suffix = name[name.rfind(".") :].lower()
    return suffix == ".toml" or suffix in SUFFIXES
