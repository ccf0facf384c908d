"""The tables of docs/positioning_study.md about random stages, from the figures of `random_study`."""

from typing import Any

import numpy as np

from studies.markdown_table import markdown_table

COLUMNS = {
    "largest_um": "largest deviation",
    "largest_by_scale_um": "the same by the scale",
    "A_um": "A",
    "R_um": "R",
    "E_um": "E",
    "B_um": "B",
}


def tables(figures: dict[str, Any]) -> str:
    """Return the tables in Markdown: all settings over the stages, and what both searches found."""
    return "\n".join((over_stages(figures), search_rows(figures), shaper_rows(figures)))


def over_stages(figures: dict[str, Any]) -> str:
    """Return median and worst of every figure over the random stages, and how many are within the aim."""
    stages, aim_um = figures["stages"], figures["aim_um"]
    heads = [f"{name}, median, worst" for name in COLUMNS.values()]
    rows = []
    for setting in stages[0]:
        cells = [setting]
        for key in COLUMNS:
            values = [stage[setting][key] for stage in stages]
            cells.append(f"{np.median(values):.2f}, {max(values):.2f}")
        within = sum(stage[setting]["largest_um"] <= aim_um for stage in stages)
        rows.append([*cells, f"{within} of {len(stages)}"])
    return markdown_table([f"{len(stages)} random stages", *heads, f"largest within {aim_um:g} um"], rows)


def search_rows(figures: dict[str, Any]) -> str:
    """Return what the search found for every setting, the best first."""
    heads = ("gain", "corrections", "largest deviation, mean of the training stages, um")
    rows = [
        (f"{row['gain']:g}", str(row["corrections"]), f"{row['cost_um']:.2f}") for row in figures["search"]
    ]
    return markdown_table(heads, rows)


def shaper_rows(figures: dict[str, Any]) -> str:
    """Return what the search found for every kind of input shaper, the best first."""
    heads = ("input shaper", "largest deviation, mean of the further stages, um", "worst, um")
    rows = [
        (row["shaper"] or "none", f"{row['cost_um']:.2f}", f"{row['worst_um']:.2f}")
        for row in figures["shapers"]
    ]
    return markdown_table(heads, rows)
