"""`reconcile.diagnose`: tables in, a typed result out."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from reconcile.api.frames import Frame, Model, files_of, model_file
from reconcile.api.result import Diagnosis, Plots, findings_of, repaired_model
from reconcile.diagnosis.diagnose import diagnose as diagnose_files
from reconcile.formats.mapping import parse_mapping


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
