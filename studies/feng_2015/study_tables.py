"""The tables of docs/friction_study.md from the figures of `experiment friction` and `experiment drift`."""

from collections.abc import Iterator
from typing import Any

from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.published import (
    FENG_2015_CLAIMS_PERCENT,
    FENG_2015_X_OBSERVER,
    FENG_2015_X_PULSE,
    FENG_2015_X_UNCOMPENSATED,
)
from studies.feng_2015.variants import OBSERVER, PULSE, SINGLE, WITHOUT
from studies.feng_2015.waveform_study import WAVEFORM
from studies.markdown_table import markdown_table

VARIANTS = (WITHOUT, OBSERVER, PULSE, SINGLE, WAVEFORM)
PUBLISHED_X = {WITHOUT: FENG_2015_X_UNCOMPENSATED, OBSERVER: FENG_2015_X_OBSERVER, PULSE: FENG_2015_X_PULSE}
INDICATORS = ("contour peak", "mean \\|e\\|", "peak \\|e\\|", "RMS e")


def motions(figures: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield group of the claims, name, and entry of every motion: circles, then S-shaped motions."""
    for entry in figures["circle"]:
        yield entry["axis"], f"{entry['axis']} F {entry['feed_mm_min']}", entry
    for entry in figures["s_shaped"]:
        yield "S", entry["name"], entry


def errors(figures: dict[str, Any]) -> str:
    """Return the indicators of every motion and variant; in brackets: the paper's, on x."""
    rows = []
    for group, name, entry in motions(figures):
        for variant in VARIANTS:
            values = ReversalFigures(**entry[variant])
            theirs = PUBLISHED_X.get(variant, {}).get(entry.get("feed_mm_min", 0)) if group == "x" else None
            cells = [f"{value:.2f}" for value in values]
            if theirs is not None:
                cells = [f"{cell} ({value:.2f})" for cell, value in zip(cells, theirs, strict=True)]
            rows.append([name if variant == WITHOUT else "", variant, *cells])
    return markdown_table(["motion", "variant", *INDICATORS], rows)


def reductions(figures: dict[str, Any]) -> str:
    """Return the reductions by the pulse beside the claims, and the least of the waveform's four."""
    rows = []
    for group, name, entry in motions(figures):
        found = entry["reductions_percent"]
        pairs = zip(found[PULSE].values(), FENG_2015_CLAIMS_PERCENT[group], strict=True)
        cells = [f"{value:.1f} ({claim:.0f})" for value, claim in pairs]
        met = "met" if entry["bars_met"] else "missed"
        rows.append([name, *cells, met, f"{min(found[WAVEFORM].values()):.1f}"])
    return markdown_table(["motion", *INDICATORS, "claim", "LWC: least of the four"], rows)


def learning(figures: dict[str, Any]) -> str:
    """Return strokes, machine time and J of every learner and axis."""
    found, rows = figures["learning"], []
    for learner in ("paper", "fast", "bus"):
        for axis, entry in found.get(learner, {"axes": {}})["axes"].items():
            whole = found[learner] | entry  # over the bus all axes learn in one run
            took = [f"{whole['wall_s']:.0f} s", f"{whole['times_real_time']:.0f}"]
            rows.append([learner, axis, *_outcome(entry, took)])
    for axis, entry in found["waveforms"]["axes"].items():
        rows.append(["waveform", axis, *_outcome(entry, ["", ""])])
    heads = ("strokes", "machine time", "in", "times real time", "J before", "J after")
    return markdown_table(["learner", "axis", *heads], rows)


def _outcome(entry: dict[str, Any], took: list[str]) -> list[str]:
    machine_time = f"{entry['machine_time_s'] / 3600.0:.2f} h"
    evaluations = [f"{entry[key]:.2f} um" for key in ("before", "after")]
    return [str(entry["strokes"]), machine_time, *took, *evaluations]


def repeated(figures: dict[str, Any]) -> str:
    """Return the strokes of the twin that were made again over the bus."""
    rows = [
        [
            stroke["axis"],
            stroke["stage"],
            f"{stroke['acceleration_mm_s2']:.3g}",
            f"{stroke['J_twin']:.4f}",
            f"{stroke['J_bus']:.4f}",
        ]
        for stroke in figures["learning"]["repeated_on_bus"]["strokes"]
    ]
    return markdown_table(["axis", "stage", "a, mm/s^2", "J twin, um", "J bus, um"], rows)


def learners(figures: dict[str, Any]) -> str:
    """Return strokes and J of both learners of the pulse, all axes together, for docs/learning.md."""
    rows = []
    for learner in ("fast", "paper"):
        entry = figures["learning"][learner]
        axes = entry["axes"].values()
        hours = sum(axis["machine_time_s"] for axis in axes) / 3600.0
        after = ", ".join(f"{axis['after']:.2f}" for axis in axes)
        strokes = str(sum(axis["strokes"] for axis in axes))
        rows.append([f"`{learner}`", strokes, f"{hours:.1f} h", f"{after} um", f"{entry['wall_s']:.0f} s"])
    return markdown_table(["", "strokes", "machine time", "J x, y", "in the batch twin, two cores"], rows)


def drift(figures: dict[str, Any]) -> str:
    """Return J of production before friction changes, behind it, and learned again."""
    names = {
        "compensated": "compensated",
        "friction changed": "friction has changed, the functions are stale",
        "learned again": "learned again",
    }
    rows = [[names[key], f"{value:.2f} um"] for key, value in figures["J_um"].items()]
    return markdown_table(["production", f"J of {figures['axis']}, median"], rows)
