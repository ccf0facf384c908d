"""The verdict on a terminal: the sentence, what was found, and the fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from reconcile.report_words import SENSES, headline, interval, parameter_names, percent, reading, title

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import Console

COLOURS = {"consistent": "green", "parameters": "cyan", "effects": "yellow", "unknown": "magenta"}


def show(verdict: Mapping[str, Any], console: Console) -> None:
    """Print it; what comes from files is never read as markup."""
    said = headline(verdict)
    console.print(Text(f"verdict: {verdict['verdict']}", style=f"bold {COLOURS[verdict['verdict']]}"))
    console.print(Text(said.sentence, style="bold"))
    console.print(Text(said.advice))
    for finding in verdict["findings"]:
        alike = f" (or {', '.join(finding['equivalent'])})" if finding["equivalent"] else ""
        console.print()
        console.print(
            Text(f"axis {finding['axis']}: ")
            + Text(finding["effect"], style="bold")
            + Text(f"{alike}, confidence {percent(finding['confidence'])}")
        )
        console.print(Text(f"  {finding['explanation']}"))
        names = parameter_names(finding["parameters"])
        for key, parameter in finding["parameters"].items():
            console.print(Text(f"  {names[key]}: {interval(parameter)}"))
    console.print()
    console.print(_fit(verdict["fit"]))
    for note in verdict["notes"]:
        console.print(Text(f"sensors: {note}", style="dim"))
    for entry in verdict["not_observable"]:
        effects = ", ".join(title(name) for name in entry["effects"])
        console.print(Text(f"axis {entry['axis']}, not observable ({entry['why']}): {effects}", style="dim"))


def _fit(fit: Mapping[str, Any]) -> Table:
    table = Table(title="RMS of what the model misses", title_justify="left", box=None, pad_edge=False)
    for name in ("axis", "in", "nominal", "refitted", "with the effects"):
        table.add_column(name, justify="left" if name in {"axis", "in"} else "right")
    for axis, senses in fit.items():
        for sense, levels in senses.items():
            factor, unit = reading(levels["unit"], levels["before"]["heldout"])
            values = [levels[model]["heldout"] / factor for model in ("before", "refitted", "after")]
            table.add_row(axis, SENSES.get(sense, sense), *(f"{value:.3g} {unit}" for value in values))
    table.caption = "on blocks that were held out"
    table.caption_justify = "left"
    return table
