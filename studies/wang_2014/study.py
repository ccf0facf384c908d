"""Figures of the positioning study: the paper's simple one, ISO 230-2, and the bars.

The simple figure is the largest |deviation| of the readings by the scale. The paper does not define its
figure: its 25.00 um are the warranty of the manufacturer, which every approach must keep; its 11.92 +- 1
reads like a mean with a spread, so the mean |deviation| and half the range are reported too.
"""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.metrology.iso_230_2 import Positioning, positioning
from studies.wang_2014.plan import AT_100MM, IRREGULAR, OVER_TRAVEL
from studies.wang_2014.readings import Deviations
from studies.wang_2014.stages import PAPER, STAGES

Found = Mapping[tuple[str, str], Deviations]

UM = 1e6
WANG_2014_UM = {"uncompensated": 25.00, "open_loop": 11.92, "sampled_dual_loop": 6.49, "smoothed": 1.14}
"""Published at 100 mm (Wang et al. 2014); open_loop with a spread of +- 1."""
FINAL_UM = WANG_2014_UM["smoothed"]
AIM_UM = 0.5
"""One count of the scale."""
FINAL_STAGES = ("smoothed", "screw_table_sampled")
"""Stages that the final bar applies to, without and with the screw table."""


class Simple(NamedTuple):
    """The simple figures of one stage over one series, micrometres."""

    largest_um: float
    mean_um: float
    half_range_um: float
    """Half the range of the deviations at one target from one side; the largest of all."""
    slope_um_mm: float
    """Slope of the line through the mean deviations over the targets; 0 for a single target."""


class PositioningBar(NamedTuple):
    """A figure of the study and its upper limit."""

    what: str
    value: float
    limit: float

    @property
    def met(self) -> bool:
        """Whether the value is within the limit."""
        return self.value <= self.limit


def simple(target_mm: Array, deviation_m: Array) -> Simple:
    """Return the simple figures of deviations (runs, targets, 2) at `target_mm` (targets,)."""
    deviation_um = deviation_m * UM
    slope = 0.0
    if len(target_mm) > 1:
        slope = float(np.polyfit(target_mm, deviation_um.mean(axis=(0, 2)), 1)[0])
    return Simple(
        largest_um=float(np.abs(deviation_um).max()),
        mean_um=float(np.abs(deviation_um).mean()),
        half_range_um=float(0.5 * np.ptp(deviation_um, axis=0).max()),
        slope_um_mm=slope,
    )


def simple_figures(found: Found, series: str) -> dict[str, Simple]:
    """Return the simple figures by the scale, for every stage that was run over the series."""
    return {
        stage: simple(found[series, stage].target_mm, found[series, stage].scale_m)
        for stage in STAGES
        if (series, stage) in found
    }


def iso_figures(found: Found, series: str = OVER_TRAVEL.name) -> dict[str, Positioning]:
    """Return the ISO 230-2 figures over the travel, from the readings of the interferometer."""
    return {
        stage: positioning(found[series, stage].interferometer_m)
        for stage in STAGES
        if (series, stage) in found
    }


def bars(found: Found) -> list[PositioningBar]:
    """Return the bars: each stage better than the one before, the final ones flat and as published."""
    entries = []
    for series in (AT_100MM.name, OVER_TRAVEL.name):
        figures = simple_figures(found, series)
        for before, after in pairwise(PAPER):
            if before.name in figures and after.name in figures:
                what = f"{series}: {after.name} below {before.name}"
                # strictly below, not equal
                limit = np.nextafter(figures[before.name].largest_um, 0.0)
                entries.append(PositioningBar(what, figures[after.name].largest_um, float(limit)))
        entries += [
            PositioningBar(f"{series}: {stage}, largest", figures[stage].largest_um, FINAL_UM)
            for stage in FINAL_STAGES
            if stage in figures
        ]
    entries += [
        PositioningBar(f"{stage} flat: rise over the targets, um", _rise_um(found, stage), AIM_UM)
        for stage in FINAL_STAGES
        if (OVER_TRAVEL.name, stage) in found
    ]
    return entries


def _rise_um(found: Found, stage: str) -> float:
    deviations = found[OVER_TRAVEL.name, stage]
    slope = simple(deviations.target_mm, deviations.scale_m).slope_um_mm
    return abs(slope) * float(np.ptp(deviations.target_mm))


def summary(found: Found) -> dict[str, Any]:
    """Return the study for JSON: micrometres."""
    at_100mm, over_travel = (simple_figures(found, name) for name in (AT_100MM.name, OVER_TRAVEL.name))
    slopes = {f"slope_{stage}_um_per_mm": figures.slope_um_mm for stage, figures in over_travel.items()}
    iso = {stage: _iso(figures) for stage, figures in iso_figures(found).items()}
    irregular = {stage: _iso(figures) for stage, figures in iso_figures(found, IRREGULAR.name).items()}
    for stage, entry in iso.items():
        entry["by_scale"] = _iso(positioning(found[OVER_TRAVEL.name, stage].scale_m))
    return {
        AT_100MM.name: _simple(at_100mm),
        OVER_TRAVEL.name: {**_simple(over_travel), **slopes},
        "iso_230_2": iso,
        "iso_230_2_irregular_targets": irregular,
        "published_um": dict(WANG_2014_UM),
        "simple_figure": "largest |deviation| by the scale",
        "bars": [{**bar._asdict(), "met": bar.met} for bar in bars(found)],
    }


def _simple(figures: Mapping[str, Simple]) -> dict[str, Any]:
    return {
        **{f"{stage}_um": entry.largest_um for stage, entry in figures.items()},
        "mean_um": {stage: entry.mean_um for stage, entry in figures.items()},
        "half_range_um": {stage: entry.half_range_um for stage, entry in figures.items()},
    }


def _iso(figures: Positioning) -> dict[str, Any]:
    return {
        "A_um": figures.accuracy_m * UM,
        "R_um": figures.repeatability_m * UM,
        "E_um": figures.systematic_m * UM,
        "M_um": figures.mean_bidirectional_m * UM,
        "B_um": figures.reversal_m * UM,
        "B_mean_um": figures.reversal_mean_m * UM,
        **{
            f"{letter}_{direction}_um": value_m * UM
            for direction, one in (("up", figures.up), ("down", figures.down))
            for letter, value_m in (
                ("A", one.accuracy_m),
                ("R", one.repeatability_m),
                ("E", one.systematic_m),
            )
        },
    }


def missed(entries: Iterable[PositioningBar]) -> list[PositioningBar]:
    """Return the bars that were not met."""
    return [bar for bar in entries if not bar.met]
