"""`reconcile example` on a published machine: its first recording is held out, the others are diagnosed.

The model file from the others is loaded again and compared with the held-out recording, beside a rigid model
and textbook friction fitted to the others.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.diagnosis.diagnose import WrittenDiagnosis, diagnose
from reconcile.errors import ReconcileError
from reconcile.examples.example import ExampleResult, Row, reports, write_figures
from reconcile.examples.real import bam, dfki, fditools, kinova, kuka
from reconcile.examples.real.judged import Judged, judged, model_residual_n
from reconcile.examples.real.machine import Machine, Read
from reconcile.examples.real.textbook import least_squares, rigid
from servo_ctrl.files.whole_file import write_whole
from servo_ctrl.plots.matplotlib_agg import Figure

MACHINES: Mapping[str, Read] = {
    "fditools_motor": fditools.motor_only,
    "fditools_load": fditools.with_load_encoder,
    "kuka": kuka.robot,
    "dfki_a": dfki.build_a,
    "dfki_c": dfki.build_c,
    "kinova": kinova.cobot,
    "bam": bam.pendulum,
}
SETS: Mapping[str, tuple[str, ...]] = {
    "fditools": ("fditools_motor", "fditools_load"),
    "kuka": ("kuka",),
    "dfki": ("dfki_a", "dfki_c"),
    "kinova": ("kinova",),
    "bam": ("bam",),
}
"""The machines of each name of `reconcile example`."""


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


COLOURS = {"rigid": "tab:orange", "textbook": "tab:green", "written model": "tab:blue"}
LONGEST_S = 4.0
"""Drawn duration; in a longer one no detail would be visible."""


class Traces(NamedTuple):
    """One axis in the held-out recording."""

    axis: str
    one: Judged
    left_n: Mapping[str, Array]
    """Residual (n,) by model."""


def left_out(path: Path, title: str, source: str, traces: Sequence[Traces]) -> Path:
    """Draw the torque and the residuals of the models."""
    figure = Figure(figsize=(11.0, 1.5 + 3.0 * len(traces)), layout="constrained")
    figure.suptitle(f"{title}: {source}, which was left out")
    for axes, of in zip(np.atleast_1d(figure.subplots(len(traces), 1)), traces, strict=True):
        time_s = of.one.data.time_s
        seen = (time_s >= 0.2 * time_s[-1]) & (time_s <= 0.2 * time_s[-1] + LONGEST_S)
        axes.plot(time_s[seen], of.one.force_n[seen], color="0.7", lw=0.8, label="measured")
        for name, left_n in of.left_n.items():
            drawn = np.where(of.one.used, left_n, np.nan)[seen]
            rms = float(np.sqrt(np.mean(left_n[of.one.used] ** 2)))
            axes.plot(time_s[seen], drawn, color=COLOURS[name], lw=0.9, label=f"{name} leaves {rms:.3g} N m")
        axes.set(ylabel=f"{of.axis}: torque / N m", xlabel="time / s")
        axes.set_xlim(float(time_s[seen][0]), float(time_s[seen][-1]))
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, fontsize=8, frameon=False)
    write_whole(path, lambda temporary: figure.savefig(temporary, dpi=100, format="png"))
    return path
