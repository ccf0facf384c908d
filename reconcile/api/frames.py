"""Writes recordings and models that a program holds in memory as the files that a diagnosis reads."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reconcile.errors import ReconcileError
from reconcile.formats.arrow_files import write_table
from reconcile.formats.toml_file import toml_text

Frame = Any
"""A path; a table of Arrow, pandas or polars; arrays (n,) by column; a structured numpy array (n,)."""
Model = str | Path | Mapping[str, Any]
"""A path to a plant.toml, or its content."""


def files_of(frames: Frame | Sequence[Frame], folder: Path) -> list[Path]:
    """Return one file for each recording: a path as it is, a table written to `folder`.

    Raises ReconcileError for an object that is not a table.
    """
    many = list(frames) if isinstance(frames, list | tuple) else [frames]
    if not many:
        raise ReconcileError("frames", "", "there is no recording", "give one table, or a list of them")
    return [_file_of(frame, folder / f"frame_{number}.parquet") for number, frame in enumerate(many, 1)]


def model_file(model: Model, folder: Path) -> Path:
    """Return the file of the model: a path as it is, its content as `folder`/nominal.toml. Raises OSError."""
    if not isinstance(model, Mapping):
        return Path(model)
    file = folder / "nominal.toml"
    file.write_text(toml_text(dict(model)), encoding="utf-8")
    return file


def _file_of(frame: Frame, file: Path) -> Path:
    if isinstance(frame, str | Path):
        return Path(frame)
    names = getattr(getattr(frame, "dtype", None), "names", None)
    write_table(file, {name: frame[name] for name in names} if names else frame)
    return file
