"""The pictures of the positioning study: figures 4, 5, 7 and 8 of the paper, the other stages, an arrival."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from servo_ctrl.units import MM
from studies.wang_2014.bus_study import BusCheck, BusRun
from studies.wang_2014.plan import AT_100MM, AXIS, DOWN, OVER_TRAVEL, READ_S
from studies.wang_2014.plots import ArrivalTrace, DeviationTrace, plot_arrivals, plot_repeats, plot_targets
from studies.wang_2014.readings import Deviations
from studies.wang_2014.stages import STAGES

BEFORE = ("uncompensated", "open_loop", "sampled_dual_loop")
SMOOTHING = ("sampled_dual_loop", "smoothed")
ALTERNATIVES = ("s_curve_alone", "screw_table", "continuous_dual_loop")
TOGETHER = ("smoothed", "screw_table_sampled")


def draw_positioning(
    found: Mapping[tuple[str, str], Deviations], checks: list[BusCheck], out: Path
) -> list[Path]:
    """Draw the pictures of the stages that were run; return their files. Raises OSError."""
    pictures = []
    for series, plot, figures in (
        (AT_100MM.name, plot_repeats, "4 7"),
        (OVER_TRAVEL.name, plot_targets, "5 8"),
    ):
        first, second = figures.split()
        wanted = {
            f"{series}: sampled dual loop (paper: figure {first})": BEFORE,
            f"{series}: smoothing (paper: figure {second})": SMOOTHING,
            f"{series}: alternatives": ALTERNATIVES,
            f"{series}: with the screw table": TOGETHER,
        }
        panels = {title: _traces(found, series, names) for title, names in wanted.items()}
        panels = {title: traces for title, traces in panels.items() if traces}
        if panels:
            plot(out / f"{series}.png", panels)
            pictures.append(out / f"{series}.png")
    arrivals = {check.bus.stage: _arrival(check.bus) for check in checks if check.bus.stage in SMOOTHING}
    if arrivals:
        plot_arrivals(out / "arrivals.png", arrivals)
        pictures.append(out / "arrivals.png")
    return pictures


def _traces(
    found: Mapping[tuple[str, str], Deviations], series: str, names: tuple[str, ...]
) -> list[DeviationTrace]:
    return [
        DeviationTrace(
            name, _colour(name), found[series, name].target_mm, found[series, name].interferometer_m
        )
        for name in names
        if (series, name) in found
    ]


def _colour(name: str) -> int:
    return list(STAGES).index(name) % 6


def _arrival(bus: BusRun) -> ArrivalTrace:
    """Return the first arrival after the turn of the last run, where the lost motion must be corrected."""
    columns = bus.recording.columns
    last = max(visit.run for visit in bus.visits.values())
    step = min(step for step, visit in bus.visits.items() if visit.run == last and visit.direction == DOWN)
    place_mm = bus.series.targets_mm[bus.visits[step].target]
    rows = np.flatnonzero(columns["segment"] == step)
    period_s = float(columns["time_s"][1] - columns["time_s"][0])
    part = slice(rows[0], rows[0] + round(READ_S / period_s))
    time_s = columns["time_s"][part]
    return ArrivalTrace(
        f"scale, at {place_mm:g} mm",
        _colour(bus.stage),
        time_s - columns["time_s"][rows[0]],
        columns[f"{AXIS}.scale_position_m"][part] - place_mm * MM,
        columns[f"{AXIS}.correction_m"][part] - columns[f"{AXIS}.correction_m"][rows[0]],
    )
