"""`servo-ctrl experiment friction`: the friction study of Feng et al. 2015 on the simulated table."""

import asyncio
import resource
import time
from pathlib import Path

from rich.console import Console

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning.types import Learned
from servo_ctrl.metrology.circles import AXES
from servo_ctrl.plots.learned import LearnedAxis, plot_learned
from studies.feng_2015.plots import plot_comparison, plot_contours
from studies.feng_2015.report import print_figures
from studies.feng_2015.strokes import (
    BusLearning,
    RepeatedStroke,
    drawn_strokes,
    learn_over_bus,
    repeat_strokes,
)
from studies.feng_2015.study import FrictionStudy, cells, summary
from studies.feng_2015.twin_learning import TwinLearning, TwinStroke, learn_in_twin
from studies.feng_2015.variants import (
    OBSERVER,
    PULSE,
    WITHOUT,
    Variant,
    VariantResult,
    run_variant,
    variants,
    without_second_trapezoid,
)
from studies.feng_2015.waveform_study import WAVEFORM, WaveformStudy, learn_all


def friction_study(
    machine: Path, out: Path, json_file: Path | None, strokes: int, seed: int, *, over_bus: bool
) -> None:
    """Learn the friction compensation and compare it with Feng et al. 2015: tables, pictures, JSON."""
    start_s = time.monotonic()
    console = Console()
    paper = _learn_in_twin(console, machine, out, "paper")
    fast = _learn_in_twin(console, machine, out, "fast")
    repeated = _repeat(console, machine, out, drawn_strokes(paper, strokes, seed))
    bus = _learn_over_bus(console, machine, out) if over_bus else None
    judged, single = (paper.store if bus is None else bus.store), out / "learned" / "single"
    without_second_trapezoid(machine, judged, single)
    results = _run_variants(console, machine, out, judged, single)
    waveforms = _waveforms(console, machine, out)
    study = FrictionStudy(
        results=results,
        paper=paper,
        fast=fast,
        repeated=repeated,
        seed=seed,
        bus=bus,
        wall_s=time.monotonic() - start_s,
        processor_s=_processor_s(),
        waveforms=waveforms,
    )
    figures = summary(study)
    print_figures(console, figures)
    for picture in draw_study(machine, study, out):
        console.print(f"picture: {picture}", highlight=False)
    write_figures(json_file, figures)


def _processor_s() -> float:
    """Return the seconds on processors so far, of this process and of those that it has started and ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(entry.ru_utime + entry.ru_stime for entry in used)


def _waveforms(console: Console, machine: Path, out: Path) -> WaveformStudy:
    """Learn waveforms and tune their rivals in the batch twin; measure the waveforms over the bus."""
    store = out / "learned" / "waveforms"
    with console.status("learned waveforms and rivals, in the batch twin ..."):
        study = learn_all(machine, store)
    console.print(f"circles and S-shaped motions over the bus: {WAVEFORM} ...")
    with progress_bar() as show:
        result = asyncio.run(run_variant(machine, Variant(WAVEFORM, "waveform", store), out, show))
    found = cells({WITHOUT: result, WAVEFORM: result})
    return study._replace(figures={(cell.group, cell.label): cell.figures[WAVEFORM] for cell in found})


def _learn_in_twin(console: Console, machine: Path, out: Path, learner: str) -> TwinLearning:
    label = f"learning in the batch twin, {learner} learner"
    with console.status(f"{label} ..."):
        twin = learn_in_twin(machine, out / "learned" / learner, learner)
    strokes = sum(axis.learned.strokes for axis in twin.axes.values())
    console.print(f"{label}: {strokes} strokes in {twin.wall_s:.0f} s", highlight=False)
    return twin


def _repeat(
    console: Console, machine: Path, out: Path, strokes: dict[str, list[TwinStroke]]
) -> list[RepeatedStroke]:
    console.print("some of its strokes over the bus ...")
    with progress_bar() as show:
        return asyncio.run(repeat_strokes(machine, strokes, out, show))


def _learn_over_bus(console: Console, machine: Path, out: Path) -> BusLearning:
    console.print("learning over the bus, fast learner ...")
    with progress_bar() as show:
        return asyncio.run(learn_over_bus(machine, out / "learned" / "bus", show))


def _run_variants(
    console: Console, machine: Path, out: Path, learned: Path, single: Path
) -> dict[str, VariantResult]:
    results = {}
    for variant in variants(learned, single):
        console.print(f"circles and S-shaped motions over the bus: {variant.name} ...")
        with progress_bar() as show:
            results[variant.name] = asyncio.run(run_variant(machine, variant, out, show))
    return results


DRAWN = (WITHOUT, PULSE, OBSERVER)
QUADRANTS = {"x": "A", "y": "B"}
"""The quadrant at which an axis reverses, by the letters of the paper; C and D are alike."""


def draw_study(machine: Path, study: FrictionStudy, out: Path) -> list[Path]:
    """Draw all pictures; return their files. Raises OSError."""
    config = load_machine(machine)
    window_s = config.monitoring.window_s
    sources: list[tuple[str, dict[str, Learned]]] = [
        (name, {axis: entry.learned for axis, entry in twin.axes.items()})
        for name, twin in (("paper", study.paper), ("fast", study.fast))
    ]
    if study.bus is not None:
        sources.append(("bus", study.bus.axes))
    pictures = []
    for name, learned in sources:
        pictures.append(out / f"learned_{name}.png")
        axes = [
            LearnedAxis(axis, entry, learning_settings(config, axis).amplitude_max_m_s)
            for axis, entry in learned.items()
        ]
        plot_learned(pictures[-1], axes, f"{config.machine.name}: what was learned, {name}")
    results = {name: study.results[name] for name in DRAWN}
    circles = {name: result.circles for name, result in results.items()}
    quadrants = {
        f"{circle.label}, quadrant {QUADRANTS[axis]} ({axis} reverses)": [
            several[place].error_traces[axis]._replace(label=name) for name, several in circles.items()
        ]
        for place, circle in enumerate(circles[WITHOUT])
        for axis in AXES
    }
    plot_comparison(out / "quadrants.png", quadrants, window_s)
    contours = {
        circle.label: [several[place].contour._replace(label=name) for name, several in circles.items()]
        for place, circle in enumerate(circles[WITHOUT])
    }
    plot_contours(out / "contours.png", contours)
    shapes = {
        f"{shape.name}, {shape.axis} reverses": [
            result.shapes[place].error_trace._replace(label=name) for name, result in results.items()
        ]
        for place, shape in enumerate(results[WITHOUT].shapes)
    }
    plot_comparison(out / "s_shapes.png", shapes, window_s)
    return [*pictures, *(out / f"{name}.png" for name in ("quadrants", "contours", "s_shapes"))]
