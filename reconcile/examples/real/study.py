"""`reconcile example` on a published machine: its first recording is held out, the others are diagnosed.

The model file from the others is loaded again and compared with the held-out recording, beside a rigid model
and textbook friction fitted to the others.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reconcile.diagnosis.diagnose import WrittenDiagnosis, diagnose
from reconcile.errors import ReconcileError
from reconcile.examples.example import ExampleResult, Row, reports, write_figures
from reconcile.examples.real.judged import Judged, judged, model_residual_n
from reconcile.examples.real.machine import Machine
from reconcile.examples.real.picture import Traces, left_out
from reconcile.examples.real.sets import MACHINES
from reconcile.examples.real.textbook import least_squares, rigid

NAME = "axes"
"""Directory of the published sets, each in its own folder."""


def run(names: Sequence[str], data: Path, out: Path, on_progress: Callable[[str], None]) -> ExampleResult:
    """Diagnose the machines of a set. Raises ReconcileError: the recordings are not there."""
    machines = [MACHINES[name](data) for name in names]
    rows: list[Row] = []
    values: dict[str, Any] = {}
    files: list[Path] = []
    for machine in machines:
        on_progress(f"{machine.title}: {len(machine.recordings)} recordings")
        values[machine.name], of_machine, written = _shown(machine, out / machine.name, on_progress)
        rows += of_machine
        files += written
    return ExampleResult(machines[0].title, rows, values, [write_figures(out, values), *files])


def _shown(
    machine: Machine, out: Path, on_progress: Callable[[str], None]
) -> tuple[dict[str, Any], list[Row], list[Path]]:
    nominal, paths = machine.written(out / "recordings")
    left_name = paths[0].stem
    found: WrittenDiagnosis | None = None
    refused = ""
    try:
        found = diagnose(paths[1:], nominal, out, on_progress=on_progress, with_next=False)
    except ReconcileError as error:
        refused = str(error)
    on_progress(f"{left_name}, which was left out")
    rows = [Row(f"{machine.title}: published", "", machine.expected)]
    if found is None:
        rows.append(Row("refused", refused))
    values: dict[str, Any] = {"left_out": left_name, "refused": refused, "axes": {}}
    traces = []
    for axis, by_file in judged(paths, nominal).items():
        train = [one for file in by_file[1:] for one in file]
        if not by_file[0] or not train:
            continue
        one = by_file[0][0]
        left = {
            name: one.force_n - fit(train)(one)
            for name, fit in (("rigid", rigid), ("textbook", least_squares))
        }
        if found is not None:
            left["written model"] = model_residual_n(found.model_file, one)
        named = [] if found is None else [f["effect"] for f in found.verdict["findings"] if f["axis"] == axis]
        errors = {name: _rms(one, of) for name, of in left.items()}
        values["axes"][axis] = {"named": named, "left_nm": errors}
        figures = ", ".join(f"{name} {error:.4g}" for name, error in errors.items())
        rows += [Row(f"{axis}: named", ", ".join(named)), Row(f"{axis}: left of {left_name} / N m", figures)]
        traces.append(Traces(axis, one, left))
    files = [left_out(out / "left_out.png", machine.title, left_name, traces)]
    if found is not None:
        files += [found.model_file, *reports(found.verdict_file)]
    return values, rows, files


def _rms(one: Judged, left_n: Any) -> float:
    return math.sqrt(float(np.mean(left_n[one.used] ** 2)))
