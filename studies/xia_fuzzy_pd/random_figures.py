"""The table of docs/fuzzy_pd.md about random tables, from the figures of `random_tables`."""

from typing import Any

import numpy as np

from studies.markdown_table import markdown_table

LAWS = {"pid": "PID", "fuzzy_pd": "fuzzy-PD"}
ROWS = {
    "step_overshoot_pct": ("step of 1 mm: overshoot, %", "{:.2f}"),
    "step_settling_ms": ("step of 1 mm: settling, ms", "{:.0f}"),
    "own_step_overshoot_pct": ("step of its own: overshoot, %", "{:.2f}"),
    "own_step_settling_ms": ("step of its own: settling, ms", "{:.0f}"),
    "sine_rms_um": ("sine: RMS error, um", "{:.1f}"),
    "sine_peak_um": ("sine: peak error, um", "{:.1f}"),
    "dead_time_ms": ("sine: dead time, ms", "{:.0f}"),
    "rest_um": ("at rest: largest deviation, um", "{:.2f}"),
}


def over_tables(figures: dict[str, Any]) -> str:
    """Return median and worst of every figure and law, and on how many tables fuzzy-PD is no worse."""
    tables = figures["tables"]
    heads = [f"{name}, median, worst" for name in LAWS.values()]
    rows = []
    for key, (name, form) in ROWS.items():
        by_law = [np.array([table[law][key] for table in tables]) for law in LAWS]
        cells = [f"{form.format(np.median(values))}, {form.format(values.max())}" for values in by_law]
        pid, fuzzy = by_law
        rows.append([name, *cells, f"{int((fuzzy <= pid).sum())} of {len(tables)}"])
    return markdown_table([f"{len(tables)} random tables", *heads, "fuzzy-PD not above PID"], rows)
