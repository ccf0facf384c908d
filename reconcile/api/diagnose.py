"""`reconcile.diagnose`: tables in, a typed result out."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from reconcile.api.result import Diagnosis, Plots, findings_of, repaired_model
from reconcile.diagnosis.diagnose import diagnose as diagnose_files
from reconcile.errors import ReconcileError
from reconcile.formats.arrow_files import write_table
from reconcile.formats.mapping import parse_mapping
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


def diagnose(
    frames: Frame | Sequence[Frame],
    model: Model,
    *,
    columns: Sequence[str] = (),
    out: Path | str | None = None,
    proof: bool = True,
) -> Diagnosis:
    """Find the physics that `model` lacks in the recordings. Raises ReconcileError.

    `frames`: a table of pandas, Arrow or polars, arrays (n,) by name, a structured numpy array or a path, or
    a list of these. Columns have their roles by name, with the unit at the end as in `position_mm`; otherwise
    `columns` maps them, as `--map` does: ["time=t_s", "position=q*1e-3"]. `model`: a plant.toml or its
    content. With `out` it writes verdict.json, model.toml and report.html there. With `proof` it leaves each
    recording out in turn.
    """
    with TemporaryDirectory(prefix="reconcile-") as name:
        folder = Path(name)
        done = diagnose_files(
            files_of(frames, folder),
            model_file(model, folder),
            folder / "out" if out is None else Path(out),
            parse_mapping(columns),
            with_report=out is not None,
            with_next=out is not None,
            with_proof=proof,
        )
        return Diagnosis(
            verdict=done.verdict,
            findings=findings_of(done.verdict),
            model=repaired_model(done.model_file),
            plot=Plots(tuple(done.residual_analyses)),
        )
