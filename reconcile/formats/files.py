"""The recordings that a command line names: files, directories of a recording, folders of files, patterns."""

from collections.abc import Sequence
from pathlib import Path

from reconcile.errors import ReconcileError
from reconcile.formats.readers import CANDUMP, READERS

HEADER = "recording.json"
"""The file that makes a directory a recording of servo-ctrl."""
WILDCARDS = "*?["


def recordings_of(paths: Sequence[Path]) -> list[Path]:
    """Return each recording once, in order: the contents of a folder, the matches of a pattern.

    A missing path stays, so that its reader reports it. Raises ReconcileError for a pattern without a match.
    """
    found: list[Path] = []
    for path in paths:
        if path.exists():
            found += _in_folder(path) if path.is_dir() and not _was_recorded(path) else [path]
        elif any(mark in str(path) for mark in WILDCARDS):
            found += _matching(path)
        else:
            found.append(path)
    return list(dict.fromkeys(found))


def _matching(pattern: Path) -> list[Path]:
    """Return the recordings that match; `**` matches folders at any depth."""
    root = Path(pattern.anchor or ".")
    matches = sorted(root.glob(str(pattern.relative_to(pattern.anchor) if pattern.anchor else pattern)))
    matches = [path for path in matches if _is_recording(path)]
    if not matches:
        raise ReconcileError(pattern, "", "matches no recording", f"known are: {known_suffixes()}")
    return matches


def _in_folder(folder: Path) -> list[Path]:
    """Return the recordings of a folder, by name; the folder itself, to be refused, where it holds none."""
    return [path for path in sorted(folder.iterdir()) if _is_recording(path)] or [folder]


def _is_recording(path: Path) -> bool:
    if path.is_dir():
        return _was_recorded(path)
    return path.suffix.lower() in {*READERS, CANDUMP}


def _was_recorded(folder: Path) -> bool:
    """Return whether a folder is a recording of servo-ctrl, damaged or not."""
    return (folder / HEADER).exists() or any(folder.glob("part-*.parquet"))


def known_suffixes() -> str:
    """Return the suffixes of the formats, for messages."""
    return ", ".join(sorted({*READERS, CANDUMP}))
