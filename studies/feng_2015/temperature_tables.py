"""The table and the aims of docs/friction_study.md about friction over temperature, from its figures."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from studies.markdown_table import markdown_table

HALF = 0.5
"""Aim of J behind a cold start relative to that of adaptation alone, median of the tables."""
WORSE_RATIO, WORSE_UM = 1.25, 0.1
"""No figure may exceed that of adaptation alone by this factor and this much; chosen: reversals scatter."""
GROUPS = {
    "cold_start": "cold start, first 4",
    "warm_up": "warm-up",
    "behind_pauses": "behind pauses, first 4",
    "all": "all",
}
"""Groups of reversals in the figures, and their names."""
COURSES = {
    "unchanged": "no adaptation",
    "adaptation": "adaptation alone",
    "schedule": "with a sensor of the guide",
    "misleading": "with one of something else",
    "stuck": "with one that sticks",
}
KINDS = {"warming": "changes with temperature", "constant": "does not change"}
"""Kinds of tables in the figures, and what their friction does."""


def by_course(figures: dict[str, Any]) -> str:
    """Return the table: median and worst J of each course by group of reversals."""
    rows = []
    for kind, friction in KINDS.items():
        tables = figures[kind]
        for course, name in COURSES.items():
            if course in tables[0]["J_um"]:
                cells = [_median_and_worst(tables, course, group) for group in GROUPS]
                rows.append([friction, name, *cells])
    return markdown_table(["friction", "J, um: median, worst table", *GROUPS.values()], rows)


def aims(figures: dict[str, Any]) -> Iterator[tuple[str, str, bool]]:
    """Yield aim, figure, and whether it is met."""
    warming = figures["warming"]
    for group in ("cold_start", "behind_pauses", "warm_up"):
        ratio = round(float(np.median(_ratios(warming, "schedule", group))), 2)
        text = f"friction over temperature, {GROUPS[group]}: at most half of J of adaptation alone, median"
        yield text, f"{ratio:.2f} of it", ratio <= HALF
    bound = f"no table above {WORSE_RATIO:g} J of adaptation alone + {WORSE_UM:g} um"
    for kind, friction in KINDS.items():
        for course in ("schedule", "misleading", "stuck"):
            if course in figures[kind][0]["J_um"]:
                worse = _worse(figures[kind], course)
                figure = f"{len(worse)} of {len(figures[kind])} above" + (
                    f", worst {max(worse):.2f} um more" if worse else ""
                )
                yield f"friction {friction}, {COURSES[course]}: {bound}", figure, not worse


def _median_and_worst(tables: list[dict[str, Any]], course: str, group: str) -> str:
    values_um = [table["J_um"][course][group] for table in tables]
    return f"{np.median(values_um):.2f}, {max(values_um):.2f}"


def _ratios(tables: list[dict[str, Any]], course: str, group: str) -> list[float]:
    return [table["J_um"][course][group] / table["J_um"]["adaptation"][group] for table in tables]


def _worse(tables: list[dict[str, Any]], course: str) -> list[float]:
    """Return by how much (um) tables exceed adaptation alone in any group, of those above the bound."""
    found = []
    for table in tables:
        pairs = [(table["J_um"][course][group], table["J_um"]["adaptation"][group]) for group in GROUPS]
        above = [ours - alone for ours, alone in pairs if ours > WORSE_RATIO * alone + WORSE_UM]
        found += [max(above)] if above else []
    return found
