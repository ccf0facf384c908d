"""The machine's programs directory: which programs there are, reading them, and saving edited ones."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from servo_ctrl.config.errors import ConfigError
from servo_ctrl.config.part_program import SUFFIXES
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from pathlib import Path

LARGEST_BYTES = 1 << 20
MOST_PROGRAMS = 500
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,79}")


def programs_in(directory: Path) -> list[str]:
    """Names of the programs there, sorted; none where there is no such directory."""
    try:
        found = [entry.name for entry in directory.iterdir() if _is_program(entry.name) and entry.is_file()]
    except OSError:
        return []
    return sorted(found)[:MOST_PROGRAMS]


def read_program(directory: Path, name: str) -> str:
    """Its text. Raises ConfigError."""
    path = _path(directory, name)
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise ConfigError(name, "", f"is larger than the {LARGEST_BYTES} bytes that this page edits")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(name, "", f"cannot be read: {error}") from None


def save_program(directory: Path, name: str, text: str) -> None:
    """Write it whole or not at all; one of that name is replaced. Raises ConfigError."""
    path = _path(directory, name)
    if len(text.encode("utf-8", "surrogatepass")) > LARGEST_BYTES:
        raise ConfigError(name, "", f"is larger than {LARGEST_BYTES} bytes")
    try:
        directory.mkdir(exist_ok=True)
        write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
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
