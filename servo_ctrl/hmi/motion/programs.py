"""The programs directory of the machine: lists, reads, saves and checks programs."""

import re
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from kernels.compiler_memory import release_compiler
from servo_ctrl.config.dry_run import DryRun, dry_run
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.part_program import SUFFIXES, PartProgram, ProgramEntry, ReadingOptions
from servo_ctrl.config.program import check_program
from servo_ctrl.errors import ConfigError
from servo_ctrl.files.whole_file import write_text_whole

MAX_PROGRAM_BYTES = 1 << 20
"""Bounds what is sent to a browser's editor."""
MAX_PROGRAMS = 500
"""Bounds the list that a browser gets."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,79}")
MAX_POINTS = 4000
"""Bounds the points of the path that a browser gets; chosen: more than a screen has pixels across."""


def programs_in(directory: Path) -> list[str]:
    """Return the names of the programs, sorted; none where there is no such directory."""
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
            f"is not a name for a program: letters, digits, space, _ - and ., ending in one of {endings}",
        )
    return directory / name


def _is_program(name: str) -> bool:
    suffix = name[name.rfind(".") :].lower()
    return suffix == ".toml" or suffix in SUFFIXES


class Preview(NamedTuple):
    """What a program does that stays within the limits from home; SI."""

    axes: tuple[str, ...]
    steps: int
    run: DryRun
    position_m: Array
    """(points, axes), at equal distances along the path."""
    speed_m_s: Array
    """(points,)."""
    entry: ProgramEntry | None = None
    """What holds where it is entered behind its first line."""


def preview_of(machine_file: Path, name: str, text: str, reading: ReadingOptions | None = None) -> Preview:
    """Check a program and return its path. Raises the ConfigError of the loader, with the program's name."""
    machine = load_machine(machine_file)
    with tempfile.TemporaryDirectory(prefix="servo_ctrl_program_") as directory:
        path = Path(directory) / Path(name).name
        path.write_text(text, encoding="utf-8", errors="replace")
        try:
            program = load_program(path, machine, reading=reading)
            steps = check_program(program, machine)
        except ConfigError as error:
            file = name if error.file == str(path) else Path(error.file).name
            raise ConfigError(file, error.key, error.reason) from None
    run = dry_run(steps, machine)
    drawn = equidistant(run.plot_m, run.plot_m_s)
    release_compiler()  # the first program loads the kernels of planning
    entry = program.entry if isinstance(program, PartProgram) else None
    return Preview(tuple(machine.axes), len(steps), run, *drawn, entry)


def is_part_program_name(name: str) -> bool:
    """Whether a file of this name is G-code."""
    return name[name.rfind(".") :].lower() in SUFFIXES


def equidistant(position_m: Array, speed_m_s: Array) -> tuple[Array, Array]:
    """Resample positions (n, axes) and speeds (n,) from equal times to equal distances along the path."""
    step_m = np.linalg.norm(np.diff(position_m, axis=0), axis=1)
    distance_m = np.concatenate(([0.0], np.cumsum(step_m)))
    points_m = np.linspace(0.0, distance_m[-1], min(MAX_POINTS, len(distance_m)))
    columns = [np.interp(points_m, distance_m, column) for column in position_m.T]
    return np.column_stack(columns), np.interp(points_m, distance_m, speed_m_s)
