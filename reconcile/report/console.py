"""The verdict on a terminal: sentence and advice, findings, fit, replay, next experiment and notes."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from kernels.readable_units import display_unit
from reconcile.formats.rotary_units import unit_of
from reconcile.report.experiment_text import next_experiment_text
from reconcile.report.unnamed_curve import curve_as_text
from reconcile.report.unnamed_map import map_as_text
from reconcile.report.words import (
    CHANNEL_NAMES,
    display_name,
    headline,
    interval,
    is_rotary,
    minor_effects,
    parameter_names,
    percent,
    quantity,
    residual_levels,
)

COLOURS = {"consistent": "green", "parameters": "cyan", "effects": "yellow", "unknown": "magenta"}
"""Colour of a verdict on a terminal."""


def show(verdict: Mapping[str, Any], console: Console) -> None:
    """Print a verdict; text from files is never interpreted as markup."""
    summary = headline(verdict)
    console.print(Text(f"verdict: {verdict['verdict']}", style=f"bold {COLOURS[verdict['verdict']]}"))
    console.print(Text(summary.sentence, style="bold"))
    console.print(Text(summary.advice))
    for finding in verdict["findings"]:
        _show_finding(finding, console)
    if verdict["minor"]:
        console.print()
        console.print(Text(minor_effects(verdict)))
    console.print()
    console.print(_fit_table(verdict["fit"]))
    _show_replays(verdict, console)
    if verdict["next_experiment"]:
        console.print()
        console.print(Text(f"next experiment: {next_experiment_text(verdict)}"))
        console.print()
    for note in verdict["notes"]:
        console.print(Text(f"note: {note}", style="dim"))
    for entry in verdict["not_observable"]:
        effects = ", ".join(display_name(name) for name in entry["effects"])
        console.print(Text(f"axis {entry['axis']}, not observable ({entry['why']}): {effects}", style="dim"))


def _show_finding(finding: Mapping[str, Any], console: Console) -> None:
    equivalent = f" (or {', '.join(finding['equivalent'])})" if finding["equivalent"] else ""
    console.print()
    console.print(
        Text(f"axis {finding['axis']}: ")
        + Text(finding["effect"], style="bold")
        + Text(f"{equivalent}, confidence {percent(finding['confidence'])}")
    )
    console.print(Text(f"  {finding['explanation']}"))
    if curve := curve_as_text(finding) or map_as_text(finding):
        console.print(Text(f"  {curve}"))
        return
    names = parameter_names(finding["parameters"])
    for key, parameter in finding["parameters"].items():
        console.print(Text(f"  {names[key]}: {interval(parameter)}"))


def _show_replays(verdict: Mapping[str, Any], console: Console) -> None:
    for axis, of_axis in verdict["fit"].items():
        unit = unit_of("m", rotary=is_rotary(verdict, axis))
        for replay in of_axis.get("replay", ()):
            force_error, motor_rms_m = replay["force_error"], replay["motor_rms_m"]
            console.print(
                Text(
                    f"axis {axis}, closed-loop replay of {replay['recording']}: force error "
                    f"{100.0 * force_error['before']:.2f} -> {100.0 * force_error['after']:.2f} %, position "
                    f"{quantity(motor_rms_m['before'], unit)} -> {quantity(motor_rms_m['after'], unit)}"
                )
            )


def _fit_table(fit: Mapping[str, Any]) -> Table:
    table = Table(title="RMS of what the model misses", title_justify="left", box=None, pad_edge=False)
    for name in ("axis", "in", "nominal", "refitted", "with the effects"):
        table.add_column(name, justify="left" if name in {"axis", "in"} else "right")
    for axis, channel, levels in residual_levels(fit):
        factor, unit = display_unit(levels["unit"], levels["before"]["heldout"])
        values = [levels[model]["heldout"] / factor for model in ("before", "refitted", "after")]
        table.add_row(axis, CHANNEL_NAMES[channel], *(f"{value:.3g} {unit}" for value in values))
    table.caption = "on blocks that were held out"
    table.caption_justify = "left"
    return table
