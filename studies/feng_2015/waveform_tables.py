"""The tables of docs/friction_study.md about learned waveforms, from the figures of `waveform_robustness`."""

from typing import Any

import numpy as np

from studies.markdown_table import markdown_table

STUDY_LABELS = ("F 500", "F 1000", "F 2000", "F 3000", "S1", "S2", "S3", "S4")
"""The motions of the study: used for no learning. The others were used for no choice either."""


def by_motion(figures: dict[str, Any]) -> str:
    """Return the table of motions, on the machine as it is and over the random tables."""
    nominal, others = figures["conditions"][0]["motions"], [table["motions"] for table in figures["tables"]]
    heads = ("motion", "without, peak um", "LWC: contour peak, mean, peak, RMS um", "least reduction %")
    drawn = (f"{len(others)} tables: peak um, median, worst", "least reduction %, median, worst")
    rows = []
    for place, row in enumerate(nominal):
        peaks = [table[place]["LWC"]["contour_peak_um"] for table in others]
        reductions = [table[place]["least_reduction_percent"] for table in others]
        rows.append(
            [
                f"{row['axis']} {row['label']}",
                f"{row['WTFC']['contour_peak_um']:.2f}",
                ", ".join(f"{value:.2f}" for value in row["LWC"].values()),
                f"{row['least_reduction_percent']:.1f}",
                f"{np.median(peaks):.2f}, {max(peaks):.2f}",
                f"{np.median(reductions):.1f}, {min(reductions):.1f}",
            ]
        )
    return markdown_table([*heads, *drawn], rows)


def by_condition(figures: dict[str, Any]) -> str:
    """Return the table of conditions, with the worst of all motions."""
    study = ("study: worst peak um", "least reduction %")
    held_out_heads = ("unseen: worst peak um", "least reduction %", "not learned again: least reduction %")
    found = []
    for entry in figures["conditions"]:
        seen = [row for row in entry["motions"] if row["label"] in STUDY_LABELS]
        held_out = [row for row in entry["motions"] if row["label"] not in STUDY_LABELS]
        stale = [
            row["stale_least_reduction_percent"] for row in seen if "stale_least_reduction_percent" in row
        ]
        cells = [entry["name"], ", ".join(str(count) for count in entry["strokes"].values())]
        for rows in (seen, held_out):
            cells.append(f"{max(row['LWC']['contour_peak_um'] for row in rows):.2f}")
            cells.append(f"{min(row['least_reduction_percent'] for row in rows):.1f}")
        cells.append(f"{min(stale):.1f}" if stale else "")
        found.append(cells)
    return markdown_table(["machine", "strokes x, y", *study, *held_out_heads], found)


def by_rival(figures: dict[str, Any]) -> str:
    """Return the table of rivals: setting and robustness of both axes, their larger peak by motion."""
    study = [label for label in STUDY_LABELS if label.startswith("F")]
    rows = []
    ours = figures["conditions"][0]["motions"]
    without = {"name": "none", "motions": [{**row, **row["WTFC"]} for row in ours]}
    learned = {"name": "LWC", "motions": [{**row, **row["LWC"]} for row in ours]}
    plain = next(rival["robustness"] for rival in figures["rivals"] if "level_n" in rival["setting"]["x"])
    axes = list(plain)
    for rival in (without, *figures["rivals"], learned):
        robust = [rival.get("robustness", plain)[axis] for axis in axes]
        settings = [_setting(rival, axis) for axis in axes]
        peaks = ", ".join(f"{found['Ms']:.2f}" for found in robust)
        noise = ", ".join(f"{found['noise_n_um']:.1f}" for found in robust)
        cells = [rival["name"], *settings, peaks, noise]
        for labels in (*((label,) for label in study), ("S1", "S2", "S3", "S4")):
            peaks_um = [row["contour_peak_um"] for row in rival["motions"] if row["label"] in labels]
            cells.append(f"{max(peaks_um):.2f}")
        rows.append(cells)
    named = ", ".join(axes)
    heads = ("compensation", *(f"setting of {axis}" for axis in axes), f"Ms {named}", f"noise {named}, N/um")
    return markdown_table([*heads, *study, "S1 to S4"], rows)


def _setting(rival: dict[str, Any], axis: str) -> str:
    described = rival.get("setting", {}).get(axis, {})
    return ", ".join(f"{key} {' '.join(_numbers(value))}" for key, value in described.items())


def _numbers(value: Any) -> list[str]:
    several = value if isinstance(value, list) else [value]
    return [f"{round(entry, 6):.3g}" for entry in several]
