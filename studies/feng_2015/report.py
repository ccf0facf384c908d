"""Prints the friction study: tables of docs/friction_study.md, strokes over the bus, missed bars."""

from typing import Any

from rich.console import Console

from studies.feng_2015 import study_tables
from studies.markdown_table import titled

TABLES = {
    "Errors at the reversals, um; in brackets: Feng et al. 2015, table 3 (R = 25 mm, x)": study_tables.errors,
    "Reduction by the learned pulse (WFC), %; in brackets: the published claim": study_tables.reductions,
    "Learning: sines of R = 50 mm; J over the check strokes": study_tables.learning,
}


def print_figures(console: Console, figures: dict[str, Any]) -> None:
    """Print the figures of `study.summary`."""
    for title, table in TABLES.items():
        console.print(titled(title, table(figures)))
    repeated = figures["learning"]["repeated_on_bus"]
    same = [entry["same"] for entry in repeated["strokes"]]
    largest_um = max((abs(entry["J_bus"] - entry["J_twin"]) for entry in repeated["strokes"]), default=0.0)
    console.print(
        f"{len(same)} strokes of the twin made over the bus (drawn with seed {repeated['seed']}): "
        f"{sum(same)} with the same J, largest difference {largest_um * 1e3:.3g} nm",
        style="" if all(same) else "bold red",
        highlight=False,
    )
    speeds = ", ".join(f"{name} {times:.1f}" for name, times in figures["times_real_time"].items())
    console.print(f"over the bus in lockstep, times real time: {speeds}", highlight=False)
    if not figures["bars_missed"]:
        console.print("every bar is met: all claims, and below the observer in every cell", style="green")
    for bar in figures["bars_missed"]:
        side = "" if bar["below_WDOB"] else ", not below the observer"
        console.print(
            f"missed: {bar['where'].removeprefix('S ')} {bar['indicator']}: "
            f"{bar['reduction_percent']:.1f} % of {bar['claim_percent']:.0f} %{side}",
            style="bold red",
            highlight=False,
        )
    console.print(
        f"the whole study took {figures['wall_s']:.0f} s, "
        f"and {figures['processor_s']:.0f} s of processor time",
        highlight=False,
    )
