"""Files of a diagnosis: what there is to pick, and the repaired model on its way into use."""

from __future__ import annotations

import contextlib
import json
import os
import tomllib
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple

import tomli_w

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.telemetry.learned_directory import locked
from servo_ctrl.telemetry.parquet import reason_of, write_whole
from servo_ctrl.telemetry.recorder import HEADER_FILE

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SERVED = {"report.html": "text/html", "verdict.json": "application/json", "model.toml": "text/plain"}
"""Files of a diagnosis that a browser may have, and their kinds."""
LARGEST_MODEL = 1_000_000
MOST_RECORDINGS = 200
DEPTH = 2
"""Directories below the one that is searched for recordings."""


class FilesError(ServoCtrlError):
    """A file that cannot be used as what it was given for."""


class Recorded(NamedTuple):
    """A recording that may be picked."""

    path: Path
    name: str
    started: str
    program: str


def recordings_below(directory: Path) -> list[Recorded]:
    """The recordings in a directory and below it, the newest first; at most MOST_RECORDINGS are looked at."""
    found = []
    for path in _with_header(directory, DEPTH):
        try:
            header = json.loads((path / HEADER_FILE).read_text(encoding="utf-8"))
            started, program = str(header.get("started", "")), str(header.get("program") or "")
        except (OSError, ValueError, AttributeError, RecursionError):
            continue  # being written, or damaged: reconcile would say so, here it is just not offered
        name = str(path.relative_to(directory)) if path != directory else path.name
        found.append(Recorded(path, name, started, program))
        if len(found) == MOST_RECORDINGS:
            break
    return sorted(found, key=lambda one: one.started, reverse=True)


def models_beside(directory: Path) -> list[Path]:
    """The model files of a machine's directory."""
    found = []
    with contextlib.suppress(OSError):
        for path in sorted(directory.glob("*.toml"))[:MOST_RECORDINGS]:
            with contextlib.suppress(FilesError):
                _model(path)
                found.append(path)
    return found


def axes_of_model(path: Path) -> tuple[str, ...]:
    """The axes that a model file describes. Raises FilesError naming the file."""
    return tuple(_model(path)["axis"])


def accept_model(source: Path, target: Path, who: str) -> Path | None:
    """Copy a repaired model into its place, whole or not at all; the old file is kept beside it.

    The paths in it are made to fit the new place. Returns where the old one is now, None where there was
    none. Raises FilesError.
    """
    document = _model(source)
    if target.suffix != ".toml":
        raise FilesError(f"{target}: a model's file ends in .toml")
    if not target.parent.is_dir():
        raise FilesError(f"{target.parent}: there is no such directory")
    try:
        with locked(target.parent):
            text = _moved(document, source.parent, target.parent, who)
            kept = _keep(target)
            write_whole(target, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    except OSError as error:
        raise FilesError(f"{target}: cannot be written: {reason_of(error)}") from None
    return kept


def note_line(log: Path, who: str, what: str, details: dict[str, object]) -> None:
    """Add a line to a log that says who did what and when. Raises OSError."""
    moment = datetime.now(UTC).isoformat(timespec="milliseconds")
    line = (
        json.dumps({"format": FORMAT, "time": moment, "who": who, "what": what, **details}, default=str)
        + "\n"
    )
    log.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    try:
        os.write(descriptor, line.encode())
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _keep(target: Path) -> Path | None:
    """Give the old file a second name that nothing has; it loses its first one when it is replaced."""
    if not target.exists():
        return None
    try:
        _model(target)
    except FilesError:
        raise FilesError(f"{target}: is there and is no model; choose another place") from None
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S")
    for number in range(100):
        kept = target.with_name(f"{target.stem}.{stamp}{f'-{number}' if number else ''}.toml")
        with contextlib.suppress(FileExistsError):
            os.link(target, kept, follow_symlinks=True)
            return kept
    raise FilesError(f"{target}: the old file cannot be kept: every name for it is taken")


def _model(path: Path) -> dict[str, Any]:
    """A model file: tables [axis.NAME] with a motor or a table, as plants have and controllers have not."""
    try:
        with path.open("rb") as file:
            text = file.read(LARGEST_MODEL + 1)
        if len(text) > LARGEST_MODEL:
            raise FilesError(f"{path}: is no model: it has more than {LARGEST_MODEL} bytes")
        document = tomllib.loads(text.decode())
    except OSError as error:
        raise FilesError(f"{path}: cannot be read: {reason_of(error)}") from None
    except (ValueError, RecursionError) as error:
        raise FilesError(f"{path}: is no TOML: {error}") from None
    axes = document.get("axis")
    if not isinstance(axes, dict) or not axes:
        raise FilesError(f"{path}: is no model: it has no [axis.NAME]")
    for name, section in axes.items():
        if not isinstance(section, dict) or not {"motor", "table"} & section.keys():
            raise FilesError(f"{path}: is no model: [axis.{name}] has neither motor nor table")
    return document


def _moved(document: dict[str, Any], here: Path, there: Path, who: str) -> str:
    """The file's text for another directory: its EDS files are named relative to it."""
    for axis in document["axis"].values():
        for section in axis.values():
            if isinstance(section, dict) and isinstance(section.get("eds"), str):
                section["eds"] = os.path.relpath((here / section["eds"]).resolve(), there.resolve())
    name = "".join(character for character in who if character.isprintable())
    moment = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return f"# Written by reconcile, accepted by {name} at {moment}.\n{tomli_w.dumps(document)}"


def _with_header(directory: Path, depth: int) -> Iterator[Path]:
    """Directories that hold a recording; links are not followed."""
    if (directory / HEADER_FILE).is_file():
        yield directory
        return
    if depth == 0:
        return
    try:
        below = sorted(
            (e.path for e in os.scandir(directory) if e.is_dir(follow_symlinks=False)), reverse=True
        )
    except OSError:
        return
    for path in below[:MOST_RECORDINGS]:
        yield from _with_header(directory / path, depth - 1)
