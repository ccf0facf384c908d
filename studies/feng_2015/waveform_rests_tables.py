"""The table of docs/friction_study.md about starts behind rests, and its aims, from `waveform_rests`."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from studies.markdown_table import markdown_table

BANDS_S = ((0.05, 0.3), (0.3, 3.0), (3.0, 30.0), (30.0, 60.0))
"""Rests that are put together: below, between and above the learned ones."""
INDICATORS = ("mean_um", "peak_um", "rms_um")
KINDS = {"in the direction of the motion before": False, "against it": True}
"""Kinds of starts, and whether they turn."""
LOW_PERCENT = 10.0
"""Per cent of the starts that the middle figure of a distribution leaves below it."""


class Starts(NamedTuple):
    """Starts of all tables, (n,) each."""

    rest_s: Array
    turned: Array
    peak_um: dict[str, Array]
    least_percent: dict[str, Array]
    """By compensation: least reduction of mean, peak and RMS."""

    def of(self, chosen: Array) -> "Starts":
        """Return some of them."""
        peaks = {name: values[chosen] for name, values in self.peak_um.items()}
        least = {name: values[chosen] for name, values in self.least_percent.items()}
        return Starts(self.rest_s[chosen], self.turned[chosen], peaks, least)


def starts_of(axes: list[dict[str, Any]], variants: list[str]) -> Starts:
    """Put the starts of all axes together."""

    def column(*keys: str) -> Array:
        found = []
        for entry in axes:
            values: Any = entry
            for key in keys:
                values = values[key]
            found.append(np.array(values))
        return np.concatenate(found)

    without, *compensated = variants
    reductions = {
        name: np.min([1.0 - column(name, key) / column(without, key) for key in INDICATORS], axis=0)
        for name in compensated
    }
    return Starts(
        column("rest_s"),
        column("turned").astype(bool),
        {name: column(name, "peak_um") for name in variants},
        {name: 100.0 * values for name, values in reductions.items()},
    )


def by_rest(figures: dict[str, Any]) -> str:
    """Return the table of starts by direction and rest."""
    variants = figures["variants"]
    growing, constant = (starts_of(figures[key], variants) for key in ("growing", "constant"))
    heads = ["start", "rest s", "starts", *(f"{name}: peak um, median, worst" for name in variants)]
    heads += [f"{name}: least reduction %" for name in variants[1:]]
    heads += [f"the same tables without growth, {name}" for name in variants[1:]]
    rows = []
    for kind, turned in KINDS.items():
        for least_s, most_s in BANDS_S:
            chosen = [
                starts.of((starts.turned == turned) & (starts.rest_s >= least_s) & (starts.rest_s < most_s))
                for starts in (growing, constant)
            ]
            peaks = [f"{np.median(um):.2f}, {um.max():.2f}" for um in chosen[0].peak_um.values()]
            reductions = [_spread(part) for starts in chosen for part in starts.least_percent.values()]
            count = str(len(chosen[0].rest_s))
            rows.append([kind, f"{least_s:g} to {most_s:g}", count, *peaks, *reductions])
    return markdown_table(heads, rows)


def _spread(percent: Array) -> str:
    return f"{np.median(percent):.1f}, {np.percentile(percent, LOW_PERCENT):.1f}, {percent.min():.1f}"


def reductions(figures: dict[str, Any]) -> Iterator[tuple[str, Array]]:
    """Yield each kind of start with its reductions (n,), per cent, by what has learned rests."""
    variants = figures["variants"]
    growing = starts_of(figures["growing"], variants)
    for kind, turned in KINDS.items():
        yield kind, growing.of(growing.turned == turned).least_percent[variants[-1]]


def worse_um(figures: dict[str, Any]) -> Array:
    """Return by how much the peak (n,) of each start grows with learned rests where friction does not."""
    _, plain, learned = figures["variants"]
    constant = starts_of(figures["constant"], figures["variants"])
    return np.asarray(constant.peak_um[learned] - constant.peak_um[plain])
