"""What a fleet's rows say together: who shares what, how large it is where, and what was not diagnosed."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reconcile.fleet_rows import Row

DIAGNOSED = "diagnosed"


class Spread(NamedTuple):
    """One parameter over all axes that have it, SI."""

    name: str
    unit: str
    axes: int
    median: float
    low: float
    """Tenth of the axes are below it."""
    high: float
    """Tenth of the axes are above it."""
    largest: float
    """In size; may be negative."""
    largest_at: tuple[str, str]
    """Machine and axis."""


class Shared(NamedTuple):
    """One effect over the fleet."""

    effect: str
    axes: list[Row]
    """Those that lack it, the one to which it is worth most first."""
    machines: list[str]
    worth: float
    """Median of the share of the squares that it explains on what was held out."""
    spreads: list[Spread]


class Group(NamedTuple):
    """Machines that lack the same physics."""

    effects: tuple[str, ...]
    machines: list[str]


class FleetSummary(NamedTuple):
    """The whole."""

    rows: Sequence[Row]
    machines: list[str]
    counts: dict[str, int]
    """Axes by verdict; those without one by why."""
    shared: list[Shared]
    """The effect that most machines share first."""
    groups: list[Group]
    """The largest first; machines of which nothing was diagnosed are in none."""
    failed: list[Row]
    with_bad_files: list[Row]


def summarise(rows: Sequence[Row]) -> FleetSummary:
    """Put the rows of a fleet together."""
    machines = sorted({row["machine"] for row in rows})
    words = [row["verdict"] if row["status"] == DIAGNOSED else row["status"] for row in rows]
    by_effect: dict[str, list[Row]] = {}
    lacking: dict[str, set[str]] = {}
    for row in rows:
        if row["status"] == DIAGNOSED:
            lacking.setdefault(row["machine"], set()).update(one["effect"] for one in row["effects"])
        for effect in {one["effect"] for one in row["effects"]}:
            by_effect.setdefault(effect, []).append(row)
    shared = [_shared(effect, own) for effect, own in by_effect.items()]
    groups: dict[tuple[str, ...], list[str]] = {}
    for machine, effects in sorted(lacking.items()):
        groups.setdefault(tuple(sorted(effects)), []).append(machine)
    return FleetSummary(
        rows,
        machines,
        {word: words.count(word) for word in sorted(set(words), key=lambda word: (-words.count(word), word))},
        sorted(shared, key=lambda one: (-len(one.machines), -len(one.axes), one.effect)),
        sorted(
            (Group(effects, members) for effects, members in groups.items()),
            key=lambda group: (-len(group.machines), group.effects),
        ),
        [row for row in rows if row["status"] != DIAGNOSED],
        [row for row in rows if row["bad_files"]],
    )


def worth(row: Row, effect: str) -> float:
    """The share of the squares that the effect explains on this axis; 0 without it."""
    return max(
        (max(one["heldout_gain"] or 0.0, 0.0) for one in row["effects"] if one["effect"] == effect),
        default=0.0,
    )


def _shared(effect: str, rows: list[Row]) -> Shared:
    rows = sorted(rows, key=lambda row: (-worth(row, effect), row["machine"], row["axis"]))
    values: dict[tuple[str, str], list[tuple[float, tuple[str, str]]]] = {}
    for row in rows:
        for finding in row["effects"]:
            if finding["effect"] != effect:
                continue
            for one in finding["parameters"]:
                if one["value"] is not None and one["unit"] != "rad":  # a phase has no spread to speak of
                    place = row["machine"], row["axis"]
                    values.setdefault((one["name"], one["unit"]), []).append((one["value"], place))
    middle = float(np.median([worth(row, effect) for row in rows]))
    spreads = [_spread(name, unit, found) for (name, unit), found in values.items()]
    spreads.sort(key=lambda spread: -spread.axes)
    return Shared(effect, rows, sorted({row["machine"] for row in rows}), middle, spreads)


def _spread(name: str, unit: str, found: list[tuple[float, tuple[str, str]]]) -> Spread:
    numbers = np.array([value for value, _ in found])
    low, median, high = (float(one) for one in np.quantile(numbers, (0.1, 0.5, 0.9)))
    largest, place = max(found, key=lambda one: abs(one[0]))
    return Spread(name, unit, len(found), median, low, high, largest, place)
