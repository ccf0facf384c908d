"""Files of a diagnosis: recordings and models to choose from, and the repaired model put into use."""

import contextlib
import json
import os
import tomllib
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.errors import ServoCtrlError, reason_of
from servo_ctrl.files.diagnosis_files import MODEL_FILE, REPORT_FILE, VERDICT_FILE
from servo_ctrl.files.directory import locked
from servo_ctrl.files.toml_text import toml_text
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.recording.recorder import HEADER_FILE

MEDIA_TYPES = {REPORT_FILE: "text/html", VERDICT_FILE: "application/json", MODEL_FILE: "text/plain"}
"""The files of a diagnosis that a browser may download."""
MAX_MODEL_BYTES = 1_000_000
"""Bounds a model file; chosen: a model of three axes has about 5000 bytes."""
MAX_RECORDINGS = 200
"""Bounds the search and the list that a browser gets."""
POSITION, VELOCITY = "motor_position_m", "velocity_command_m_s"
"""Channels that tell how far an axis moves, and whether both ways."""
MAX_PARTS = 1000
"""Bounds the footers that are read for one recording: a part has some seconds of rows."""
SEARCH_DEPTH = 2
"""Bounds the levels of directories that are searched for recordings; chosen."""


class FilesError(ServoCtrlError):
    """A file cannot be used for its purpose."""


class AxisMotion(NamedTuple):
    """How far an axis moves in a recording."""

    name: str
    travel_m: float
    both_ways: bool


class FoundRecording(NamedTuple):
    """A recording to choose."""

    path: Path
    name: str
    started: str
    program: str
    length_s: float = 0.0
    """0: it has no rows, or they cannot be read."""
    axes: tuple[AxisMotion, ...] = ()


def recordings_below(directory: Path) -> list[FoundRecording]:
    """Return at most MAX_RECORDINGS recordings in a directory and below it, the newest first."""
    found = []
    for path in _recording_directories(directory, SEARCH_DEPTH):
        try:
            header = json.loads((path / HEADER_FILE).read_text(encoding="utf-8"))
            started, program = str(header.get("started", "")), str(header.get("program") or "")
        except (OSError, ValueError, AttributeError, RecursionError):
            continue  # damaged, or being written: it is not offered
        name = str(path.relative_to(directory)) if path != directory else path.name
        found.append(FoundRecording(path, name, started, program, *_extent(path, header)))
        if len(found) == MAX_RECORDINGS:
            break
    return sorted(found, key=lambda recording: recording.started, reverse=True)


def _extent(path: Path, header: dict[str, Any]) -> tuple[float, tuple[AxisMotion, ...]]:
    """Return length and motion by the footers of the parts; nothing where they cannot be read."""
    from servo_ctrl.files.arrow import parts_extent  # noqa: PLC0415  # 30 MB that only this page needs

    axes = [str(axis) for axis in header.get("axes") or ()]
    names = [f"{axis}.{channel}" for axis in axes for channel in (POSITION, VELOCITY)]
    try:
        rows, extremes = parts_extent(sorted(path.glob("part-*.parquet"))[:MAX_PARTS], names)
        length_s = rows * float(header.get("period_s", 0.0))
    except (OSError, ValueError, TypeError):
        return 0.0, ()
    motions = []
    for axis in axes:
        low_m, high_m = extremes.get(f"{axis}.{POSITION}", (0.0, 0.0))
        slowest_m_s, fastest_m_s = extremes.get(f"{axis}.{VELOCITY}", (0.0, 0.0))
        motions.append(AxisMotion(axis, high_m - low_m, slowest_m_s < 0.0 < fastest_m_s))
    return length_s, tuple(motions)


def models_in(directory: Path) -> list[Path]:
    """Return the model files in the directory of a machine."""
    found = []
    with contextlib.suppress(OSError):
        for path in sorted(directory.glob("*.toml"))[:MAX_RECORDINGS]:
            with contextlib.suppress(FilesError):
                read_model(path)
                found.append(path)
    return found


def read_model(path: Path) -> dict[str, Any]:
    """Read a model file. Raises FilesError naming the file.

    Its tables [axis.NAME] have a motor or a table, which those of a controller have neither.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MAX_MODEL_BYTES + 1)
        if len(text) > MAX_MODEL_BYTES:
            raise FilesError(f"{path}: is not a model: it has more than {MAX_MODEL_BYTES} bytes")
        document = tomllib.loads(text.decode())
    except OSError as error:
        raise FilesError(f"{path}: cannot be read: {reason_of(error)}") from None
    except (ValueError, RecursionError) as error:
        raise FilesError(f"{path}: is not TOML: {error}") from None
    axes = document.get("axis")
    if not isinstance(axes, dict) or not axes:
        raise FilesError(f"{path}: is not a model: it has no [axis.NAME]")
    for name, section in axes.items():
        if not isinstance(section, dict) or not {"motor", "table"} & section.keys():
            raise FilesError(f"{path}: is not a model: [axis.{name}] has neither motor nor table")
    return document


def accept_model(source: Path, target: Path, who: str) -> Path | None:
    """Copy a repaired model to its place, whole or not at all, and keep the old file beside it.

    Paths in the model are rewritten for the new place. Returns the path of the old file, None without one.
    Raises FilesError.
    """
    document = read_model(source)
    if target.suffix != ".toml":
        raise FilesError(f"{target}: a model's file ends in .toml")
    if not target.parent.is_dir():
        raise FilesError(f"{target.parent}: there is no such directory")
    try:
        with locked(target.parent):
            text = _moved_text(document, source.parent, target.parent, who)
            kept = _keep_old(target)
            write_text_whole(target, text)
    except OSError as error:
        raise FilesError(f"{target}: cannot be written: {reason_of(error)}") from None
    return kept


def _keep_old(target: Path) -> Path | None:
    """Link the old file to a second, unused name, under which it stays when the first one is replaced."""
    if not target.exists():
        return None
    try:
        read_model(target)
    except FilesError:
        raise FilesError(f"{target}: exists and is not a model; choose another place") from None
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S")
    for number in range(100):
        kept = target.with_name(f"{target.stem}.{stamp}{f'-{number}' if number else ''}.toml")
        with contextlib.suppress(FileExistsError):
            os.link(target, kept, follow_symlinks=True)
            return kept
    raise FilesError(f"{target}: the old file cannot be kept: every name for it is taken")


def _moved_text(document: dict[str, Any], source: Path, target: Path, who: str) -> str:
    """Return the model's text for another directory, to which the paths of its EDS files are relative."""
    for axis in document["axis"].values():
        for section in axis.values():
            if isinstance(section, dict) and isinstance(section.get("eds"), str):
                section["eds"] = os.path.relpath((source / section["eds"]).resolve(), target.resolve())
    name = "".join(character for character in who if character.isprintable())
    moment = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return f"# Written by reconcile, accepted by {name} at {moment}.\n{toml_text(document)}"


def _recording_directories(directory: Path, depth: int) -> Iterator[Path]:
    """Yield the directories that hold a recording; symbolic links are not followed."""
    if (directory / HEADER_FILE).is_file():
        yield directory
        return
    if depth == 0:
        return
    try:
        entries = [entry.path for entry in os.scandir(directory) if entry.is_dir(follow_symlinks=False)]
    except OSError:
        return
    for path in sorted(entries, reverse=True)[:MAX_RECORDINGS]:
        yield from _recording_directories(directory / path, depth - 1)
