"""Summarises the rows of a fleet: effects that machines share, their sizes, groups of machines, failures."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from reconcile.fleet.rows import Row

DIAGNOSED = "diagnosed"


class ParameterSpread(NamedTuple):
    """The distribution of one parameter over all axes that have it, SI."""

    name: str
    unit: str
    axes: int
    median: float
    low: float
    """10 % quantile."""
    high: float
    """90 % quantile."""
    largest: float
    """The value of the largest magnitude; may be negative."""
    largest_at: tuple[str, str]
    """Machine and axis."""


class SharedEffect(NamedTuple):
    """One effect on all axes that lack it in their models."""

    effect: str
    axes: list[Row]
    """The axis on which it explains the largest share comes first."""
    machines: list[str]
    median_gain: float
    """Median over the axes of the share of the held-out squares that it explains."""
    spreads: list[ParameterSpread]


class MachineGroup(NamedTuple):
    """Machines whose models lack the same effects."""

    effects: tuple[str, ...]
    machines: list[str]


class FleetSummary(NamedTuple):
    """The contents of the page of a fleet."""

    rows: Sequence[Row]
    machines: list[str]
    counts: dict[str, int]
    """Number of axes by verdict, or by the reason why there is none."""
    shared: list[SharedEffect]
    """The effect of most machines first."""
    groups: list[MachineGroup]
    """The largest group first; machines without a diagnosed axis are in none."""
    failed: list[Row]
    with_bad_files: list[Row]


def summarise(rows: Sequence[Row]) -> FleetSummary:
    """Summarise the rows of all axes."""
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
    counts = Counter(words)
    return FleetSummary(
        rows=rows,
        machines=machines,
        counts=dict(sorted(counts.items(), key=lambda item: (-item[1], item[0]))),
        shared=sorted(shared, key=lambda one: (-len(one.machines), -len(one.axes), one.effect)),
        groups=sorted(
            (MachineGroup(effects, members) for effects, members in groups.items()),
            key=lambda group: (-len(group.machines), group.effects),
        ),
        failed=[row for row in rows if row["status"] != DIAGNOSED],
        with_bad_files=[row for row in rows if row["bad_files"]],
    )


def heldout_gain(row: Row, effect: str) -> float:
    """Return the share of the held-out squares that the effect explains on this axis; 0 without it."""
    return max(
        (max(one["heldout_gain"] or 0.0, 0.0) for one in row["effects"] if one["effect"] == effect),
        default=0.0,
    )


def _shared(effect: str, rows: list[Row]) -> SharedEffect:
    rows = sorted(rows, key=lambda row: (-heldout_gain(row, effect), row["machine"], row["axis"]))
    values: dict[tuple[str, str], list[tuple[float, tuple[str, str]]]] = {}
    for row in rows:
        for finding in row["effects"]:
            if finding["effect"] != effect:
                continue
            for one in finding["parameters"]:
                if one["value"] is not None and one["unit"] != "rad":  # phases have no meaningful quantiles
                    place = row["machine"], row["axis"]
                    values.setdefault((one["name"], one["unit"]), []).append((one["value"], place))
    median = float(np.median([heldout_gain(row, effect) for row in rows]))
    spreads = [_spread(name, unit, found) for (name, unit), found in values.items()]
    spreads.sort(key=lambda spread: -spread.axes)
    return SharedEffect(effect, rows, sorted({row["machine"] for row in rows}), median, spreads)


def _spread(name: str, unit: str, found: list[tuple[float, tuple[str, str]]]) -> ParameterSpread:
    numbers = np.array([value for value, _ in found])
    low, median, high = (float(one) for one in np.quantile(numbers, (0.1, 0.5, 0.9)))
    largest, place = max(found, key=lambda one: abs(one[0]))
    return ParameterSpread(
        name=name,
        unit=unit,
        axes=len(found),
        median=median,
        low=low,
        high=high,
        largest=largest,
        largest_at=place,
    )
