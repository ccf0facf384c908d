"""The aims of the friction work beyond the paper, with today's figures: a table of docs/friction_study.md.

All figures are from the committed JSON of the studies; nothing is measured here.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from studies.feng_2015 import temperature_tables
from studies.feng_2015.waveform_rests_tables import reductions, worse_um
from studies.feng_2015.waveform_study import WAVEFORM
from studies.feng_2015.waveform_tables import STUDY_LABELS
from studies.markdown_table import markdown_table

REDUCTION_PERCENT = 90.0
CONTOUR_PEAK_UM = 1.0
STROKES = 60
RECOVERY_REVERSALS = 20
STUDY_WALL_S = 300.0
WORSE_UM = 0.1
"""The aims."""
Rows = Sequence[dict[str, Any]]


class Aim(NamedTuple):
    """An aim, its figure, and whether it is met."""

    text: str
    figure: str
    met: bool


class Positions(NamedTuple):
    """Largest deviations of random machines at rest, um, and the aim for each of them."""

    name: str
    values_um: list[float]
    aim_um: float


def at_rest(positioning: dict[str, Any], fuzzy_pd: dict[str, Any]) -> list[Positions]:
    """Return the figures at rest of the two other studies."""
    stages, stage_aim_um = positioning["stages"], positioning["aim_um"]
    settings = {"screw_table_trimmed": "without input shaper", "screw_table_shaped": "with input shaper"}
    found = [
        Positions(
            f"random stages, screw table and sampled loop, {name}: deviation off the grid, warm-up included",
            [stage[setting]["largest_um"] for stage in stages],
            stage_aim_um,
        )
        for setting, name in settings.items()
    ]
    tables, aim_um = fuzzy_pd["tables"], fuzzy_pd["aim_um"]
    at_end = [table["fuzzy_pd"]["rest_um"] for table in tables]
    return [*found, Positions("random tables with fuzzy-PD: error at rest", at_end, aim_um)]


def aims(
    waveforms: dict[str, Any],
    rests: dict[str, Any],
    recovery: dict[str, Any],
    temperature: dict[str, Any],
    study: dict[str, Any],
    positions: list[Positions],
) -> str:
    """Return the table."""
    found = [
        *_over_the_bus(study),
        *_motions(waveforms),
        *_robust(waveforms),
        *behind_rests(rests),
        *_recovery(recovery),
        *(Aim(*aim) for aim in temperature_tables.aims(temperature)),
        *map(within_aim, positions),
    ]
    rows = [[aim.text, aim.figure, "met" if aim.met else "**missed**"] for aim in found]
    return markdown_table(["aim", "figure", ""], rows)


def _over_the_bus(study: dict[str, Any]) -> Iterator[Aim]:
    entries = [*study["circle"], *study["s_shaped"]]
    least = min(min(entry["reductions_percent"][WAVEFORM].values()) for entry in entries)
    yield _reduction("circles and S1 to S4 over the bus", least)
    peak_um = max(entry[WAVEFORM]["contour_peak_um"] for entry in entries)
    yield _peak("circles up to F 3000 and S1 to S4 over the bus", peak_um)
    strokes = [entry["strokes"] for entry in study["learning"]["waveforms"]["axes"].values()]
    yield Aim(f"at most {STROKES} strokes per axis", f"{max(strokes)}", max(strokes) <= STROKES)
    wall_s = study["wall_s"]
    text = f"the whole study within {STUDY_WALL_S:.0f} s on two cores"
    figure = f"{wall_s:.0f} s, and {study['processor_s']:.0f} s of processor time"
    yield Aim(text, figure, wall_s <= STUDY_WALL_S)


def _motions(waveforms: dict[str, Any]) -> Iterator[Aim]:
    nominal = waveforms["conditions"][0]["motions"]
    for name, begins in UNSEEN.items():
        rows = [row for row in nominal if row["label"].startswith(begins)]
        yield _reduction(name, _least(rows))
        yield _peak(name, _largest_um(rows))
    ours = {(row["axis"], row["label"]): row[WAVEFORM] for row in nominal}
    ratio, rival, where = max(
        (ours[row["axis"], row["label"]][key] / row[key], rival["name"], f"{row['axis']} {row['label']}")
        for rival in waveforms["rivals"]
        for row in rival["motions"]
        for key in ours[row["axis"], row["label"]]
    )
    text = "below every rival in each indicator of each motion of the study"
    yield Aim(text, f"at most {ratio:.2f} of it ({rival}, {where})", ratio < 1.0)


UNSEEN = {
    "circles of other radii": "R ",
    "spiral": "spiral",
    "random splines": "spline",
    "outline in G-code with rounded corners": "bracket",
}
"""Kinds of motions that no learning saw, and how their labels begin."""


def _robust(waveforms: dict[str, Any]) -> Iterator[Aim]:
    for entry in waveforms["conditions"][1:]:
        yield from _on(entry["name"], entry["motions"])
    rows = [row for entry in waveforms["tables"] for row in entry["motions"]]
    yield from _on(f"worst of {len(waveforms['tables'])} random tables", rows)


def _on(name: str, rows: Rows) -> Iterator[Aim]:
    yield _reduction(f"{name}: motions of the study", _least([r for r in rows if r["label"] in STUDY_LABELS]))
    unseen = [row for row in rows if row["label"] not in STUDY_LABELS]
    yield _reduction(f"{name}: motions that no learning saw", _least(unseen))


def behind_rests(rests: dict[str, Any]) -> Iterator[Aim]:
    """Yield the aims of starts behind rests of up to a minute."""
    for kind, percent in reductions(rests):
        within = int((percent >= REDUCTION_PERCENT).sum())
        figure = f"{within} of {len(percent)}, median {np.median(percent):.1f} %, worst {percent.min():.1f} %"
        text = f"start {kind}, after a rest of up to 60 s: {REDUCTION_PERCENT:.0f} % less"
        yield Aim(text, figure, within == len(percent))
    more_um = worse_um(rests)
    worse = int((more_um > WORSE_UM).sum())
    figure = f"{worse} of {len(more_um)} by more than {WORSE_UM:g} um, worst {more_um.max():.2f} um"
    text = "where rests add no friction, no start has a larger peak with learned rests"
    yield Aim(text, figure, worse == 0)


def _recovery(recovery: dict[str, Any]) -> Iterator[Aim]:
    before = recovery["before"]
    for factor in dict.fromkeys(course["level_factor"] for course in recovery["courses"]):
        change = f"friction {100.0 * (factor - 1.0):+.0f} %"
        courses = [course for course in recovery["courses"] if course["level_factor"] == factor]
        yield recovered(courses, before, change)
        pairs = [pair for course in courses for pair in _behind(course, before, "stale_J_um")]
        worst = round(max(adapted / stale for adapted, stale in pairs), 2)
        text = f"{change}: never worse while it learns than without learning"
        yield Aim(text, f"J at most {worst:.2f} of that", worst <= 1.0)


def recovered(courses: Rows, before: int, change: str) -> Aim:
    """Return after how many reversals of production all courses have recovered from a change of friction."""
    taken = [_reversals_to_recover(course, before) for course in courses]
    late = [f"{c['axis']} F {c['feed_mm_min']}" for c, n in zip(courses, taken, strict=True) if n is None]
    most = max((count for count in taken if count is not None), default=0)
    text = f"{change}: 90 % less again within {RECOVERY_REVERSALS} reversals of production"
    return Aim(
        text, f"not on {', '.join(late)}" if late else f"{most}", not late and most <= RECOVERY_REVERSALS
    )


def _behind(course: dict[str, Any], before: int, rival: str) -> Iterable[tuple[float, float]]:
    return zip(course["adapted_J_um"][before:], course[rival][before:], strict=True)


def _reversals_to_recover(course: dict[str, Any], before: int) -> int | None:
    """Return after how many reversals J stays 90 % below that without compensation; None: never."""
    left = 1.0 - REDUCTION_PERCENT / 100.0
    good = [adapted <= left * without for adapted, without in _behind(course, before, "without_J_um")]
    if not good[-1]:
        return None
    return len(good) - next((i for i, held in enumerate(reversed(good)) if not held), len(good))


def within_aim(positions: Positions) -> Aim:
    """Return on how many of the random machines the aim is met."""
    name, values_um, aim_um = positions
    within = sum(value <= aim_um for value in values_um)
    figure = f"{within} of {len(values_um)}, worst {max(values_um):.2f} um"
    return Aim(f"{name} within {aim_um:g} um", figure, within == len(values_um))


def _least(rows: Rows) -> float:
    return min(float(row["least_reduction_percent"]) for row in rows)


def _largest_um(rows: Rows) -> float:
    return max(float(row[WAVEFORM]["contour_peak_um"]) for row in rows)


def _reduction(where: str, least: float) -> Aim:
    text = f"{where}: {REDUCTION_PERCENT:.0f} % less in all four indicators"
    return Aim(text, f"{least:.1f} % at least", least >= REDUCTION_PERCENT)


def _peak(where: str, peak_um: float) -> Aim:
    text = f"{where}: contour error within {CONTOUR_PEAK_UM:g} um at reversals"
    return Aim(text, f"{peak_um:.2f} um", peak_um <= CONTOUR_PEAK_UM)
