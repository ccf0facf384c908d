"""`servo-ctrl experiment drift`: friction changes in production; the controller learns again."""

import asyncio
from pathlib import Path

from rich.console import Console
from rich.markdown import Markdown

from servo_ctrl.cli.figures_file import write_figures
from studies.feng_2015.drift import AXIS, Drift, drift_figures, run_drift
from studies.feng_2015.plots import EvaluationTrace, plot_evaluations
from studies.feng_2015.twin_learning import learn_in_twin
from studies.markdown_table import markdown_table, titled


def drift_study(
    machine: Path,
    plant: Path | None,
    program: Path | None,
    learned: Path | None,
    out: Path,
    json_file: Path | None,
) -> None:
    """Produce with learned compensation while the x axis loses its lubrication, over the bus in lockstep."""
    console = Console()
    store = learned
    if store is None:
        store = out / "learned"
        with console.status("learning in the batch twin of the sound machine ..."):
            learn_in_twin(machine, store, "fast")

    def show_line(text: str) -> None:
        console.print(text, highlight=False)

    result = asyncio.run(
        run_drift(
            machine,
            plant=plant or machine / "plant_lubrication_loss.toml",
            program=program or machine / "programs" / "production.toml",
            learned=store,
            out=out,
            on_event=show_line,
        )
    )
    for line in result.log_lines:
        show_line(f"the controller's log: {line}")
    console.print(_table(result))
    picture = out / "drift.png"
    _draw(picture, result)
    show_line(f"picture: {picture}")
    write_figures(json_file, drift_figures(result))


def _table(result: Drift) -> Markdown:
    begins_s = (0.0, result.instants.friction_changes_s, result.instants.learning_done_s)
    rows = [
        (name, f"{begin_s:.0f} s", f"{j_m * 1e6:.2f}", "kept" if j_m <= result.required_m else "**exceeded**")
        for begin_s, (name, j_m) in zip(begins_s, result.parts_m().items(), strict=True)
    ]
    title = f"J of axis {AXIS}, um; J_required {result.required_m * 1e6:g} um"
    return titled(title, markdown_table(("production", "from", "median J", "J_required"), rows))


def _draw(path: Path, result: Drift) -> None:
    at = result.instants
    axes = dict.fromkeys(entry["axis"] for entry in result.reversals)
    traces = []
    for axis in axes:
        entries = [entry for entry in result.reversals if entry["axis"] == axis]
        times_s = [float(entry["time_s"]) for entry in entries]
        traces.append(EvaluationTrace(f"axis {axis}", times_s, [entry["error_mean_m"] for entry in entries]))
    instants = {
        "friction changes": at.friction_changes_s,
        "learning is due": at.due_s,
        "due no more": at.due_cleared_s,
    }
    last_s = max(float(entry["time_s"]) for entry in result.reversals)
    parts = {
        "production, then the friction changes": (0.0, at.learning_begun_s),
        f"after learning axis {AXIS} over the bus": (at.learning_done_s, last_s),
    }
    plot_evaluations(path, traces, result.required_m, instants, parts)
