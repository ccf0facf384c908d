"""The tables of docs/contour_control.md, from the figures of `contour_study`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from studies.markdown_table import markdown_table


def tables(figures: dict[str, Any]) -> str:
    """Return the tables in Markdown: machine by machine, and over the random tables without and with play."""
    drawn, worn = over_tables(figures["tables"]), over_tables(figures["tables_with_play"], ", play 3 um")
    return "\n".join((by_machine(figures["machines"]), drawn, worn))


def by_machine(machines: Sequence[dict[str, Any]]) -> str:
    """Return RMS and 99 % of the contour error of each motion, without, coupled and (stiffer)."""
    labels = [row["label"] for row in machines[0]["motions"]]
    heads = [
        "machine",
        "Ms",
        *(f"{label}: RMS um" for label in labels),
        *(f"{label}: 99 % um" for label in labels),
    ]
    rows = []
    for entry in machines:
        cells = [entry["name"], f"{entry['Ms']:.2f}"]
        if entry["refused"]:
            cells += ["refused", *[""] * (2 * len(labels) - 1)]
        for key in ("rms_um", "p99_um") if entry["motions"] else ():
            cells += [_three(row, key) for row in entry["motions"]]
        rows.append(cells)
    return markdown_table(heads, rows)


def over_tables(drawn: Sequence[dict[str, Any]], state: str = "") -> str:
    """Return how much of the contour error is left with the coupling: median and worst of all tables."""
    heads = (
        f"{len(drawn)} random tables{state}",
        "RMS um, median",
        "RMS um, worst",
        "RMS left %, median, worst",
        "99 % left %, median, worst",
    )
    rows = []
    for place, row in enumerate(drawn[0]["motions"]):
        measured = [entry["motions"][place] for entry in drawn]
        cells = [row["label"]]
        for pick in (np.median, np.max):
            without, coupled = (
                float(pick([one[key]["rms_um"] for one in measured])) for key in ("without", "coupled")
            )
            cells.append(f"{without:.1f} → {coupled:.1f}")
        for key in ("rms_um", "p99_um"):
            left = [100.0 * one["coupled"][key] / one["without"][key] for one in measured]
            cells.append(f"{np.median(left):.0f}, {max(left):.0f}")
        rows.append(cells)
    return markdown_table(heads, rows)


def _three(row: dict[str, Any], key: str) -> str:
    without, coupled, stiffer = (row[way][key] for way in ("without", "coupled", "stiffer"))
    return f"{without:.1f} → {coupled:.1f} ({stiffer:.1f})"
