"""Tables of the friction study: errors beside the published ones, reductions, learning, bars."""

import math

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from servo_ctrl.cli.circle_report import HEADINGS
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.types import Learned
from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.published import (
    FENG_2015_CLAIMS_PERCENT,
    FENG_2015_X_OBSERVER,
    FENG_2015_X_PULSE,
    FENG_2015_X_UNCOMPENSATED,
)
from studies.feng_2015.study import (
    UM,
    Cell,
    FrictionStudy,
    ReductionBar,
    all_cells,
    bars,
    missed,
    reductions_percent,
)
from studies.feng_2015.variants import OBSERVER, PULSE, WITHOUT

PUBLISHED_X = {
    WITHOUT: FENG_2015_X_UNCOMPENSATED,
    OBSERVER: FENG_2015_X_OBSERVER,
    PULSE: FENG_2015_X_PULSE,
}


def print_study(console: Console, study: FrictionStudy) -> None:
    """Print all tables."""
    found = all_cells(study)
    console.print(_errors(found))
    console.print(_reductions(found))
    console.print(_learning(study))
    same = [entry.same for entry in study.repeated]
    largest_m = max((abs(entry.bus_m - entry.twin_m) for entry in study.repeated), default=0.0)
    console.print(
        f"{len(same)} strokes of the twin made over the bus (drawn with seed {study.seed}): "
        f"{sum(same)} with the same J, largest difference {largest_m * 1e9:.3g} nm",
        style="" if all(same) else "bold red",
        highlight=False,
    )
    speeds = ", ".join(f"{name} {result.times_real_time:.1f}" for name, result in study.results.items())
    console.print(f"over the bus in lockstep, times real time: {speeds}", highlight=False)
    _print_missed(console, missed(found))
    console.print(
        f"the whole study took {study.wall_s:.0f} s, and {study.processor_s:.0f} s of processor time",
        highlight=False,
    )


def _errors(found: list[Cell]) -> Table:
    table = Table(
        title="Errors at the reversals, um",
        caption="in brackets: Feng et al. 2015, table 3 (circles R = 25 mm, x axis)",
        box=SIMPLE_HEAD,
        pad_edge=False,
    )
    for heading in ("motion", "variant"):
        table.add_column(heading, no_wrap=True)
    for heading in HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    for cell in found:
        for name, figures in cell.figures.items():
            published = PUBLISHED_X.get(name, {}).get(cell.feed_mm_min) if cell.group == "x" else None
            table.add_row(
                _motion(cell) if name == WITHOUT else "",
                name,
                *_beside(figures, published),
                end_section=name == list(cell.figures)[-1],
            )
    return table


def _motion(cell: Cell) -> str:
    return cell.label if cell.group == "S" else f"{cell.group} {cell.label}"


def _beside(ours: ReversalFigures, published: ReversalFigures | None) -> list[str]:
    if published is None:
        return [f"{value:.2f}" for value in ours]
    return [f"{value:.2f} ({theirs:.2f})" for value, theirs in zip(ours, published, strict=True)]


def _reductions(found: list[Cell]) -> Table:
    table = Table(
        title="Reduction by the learned pulse (WFC), %",
        caption="in brackets: the published claim; [green]ok[/green]: reached, and below the observer",
    )
    table.add_column("motion", no_wrap=True)
    for heading in HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    for place, cell in enumerate(found):
        last = place + 1 == len(found) or found[place + 1].group != cell.group
        table.add_row(_motion(cell), *map(_mark, bars(cell)), end_section=last)
    for group, claims in FENG_2015_CLAIMS_PERCENT.items():
        of_group = [reductions_percent(cell) for cell in found if cell.group == group]
        if of_group:
            least = [
                f"{min(column):.0f} ({claim:.0f})"
                for column, claim in zip(zip(*of_group, strict=True), claims, strict=True)
            ]
            table.add_row(f"{group} least", *least, style="bold")
    return table


def _mark(bar: ReductionBar) -> str:
    mark = "[green]ok[/green]" if bar.met else "[bold red]missed[/bold red]"
    return f"{bar.reduction_percent:.1f} ({bar.claim_percent:.0f}) {mark}"


def _learning(study: FrictionStudy) -> Table:
    table = Table(
        title="Learning: sines of R = 50 mm; J over the check strokes, um",
        caption="twin: the batch twin; speed: machine time against the clock",
    )
    for heading in ("learner", "axis", "strokes", "machine", "clock", "speed", "J before", "J"):
        left = heading in {"learner", "axis"}
        table.add_column(heading, justify="left" if left else "right", no_wrap=True)
    for name, twin in (("paper, twin", study.paper), ("fast, twin", study.fast)):
        for axis, entry in twin.axes.items():
            table.add_row(name, axis, *_learned(entry.learned, entry.wall_s, entry.times_real_time))
    if study.bus is not None:
        wall_s = study.bus.wall_s / max(len(study.bus.axes), 1)
        for axis, learned in study.bus.axes.items():
            table.add_row("fast, bus", axis, *_learned(learned, wall_s, study.bus.times_real_time))
    if study.waveforms is not None:
        for axis, found in study.waveforms.axes.items():
            table.add_row("LWC, twin", axis, *_learned(found.learned, study.waveforms.wall_s, math.nan))
    return table


def _learned(learned: Learned | WaveformLearned, wall_s: float, times_real_time: float) -> list[str]:
    return [
        str(learned.strokes),
        f"{learned.machine_time_s / 3600.0:.2f} h",
        f"{wall_s:.0f} s",
        "" if math.isnan(times_real_time) else f"{times_real_time:.0f}",
        f"{learned.before_m * UM:.2f}",
        f"{learned.after_m * UM:.2f}",
    ]


def _print_missed(console: Console, found: list[ReductionBar]) -> None:
    if not found:
        console.print("every bar is met: all claims, and below the observer in every cell", style="green")
    for bar in found:
        side = "" if bar.below_observer else ", not below the observer"
        console.print(
            f"missed: {_motion(bar.cell)} {bar.indicator}: "
            f"{bar.reduction_percent:.1f} % of {bar.claim_percent:.0f} %{side}",
            style="bold red",
            highlight=False,
        )
