"""Stored versions of learned results: a list of all, one of them in full, and a picture."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.table import Column, Table

from servo_ctrl.cli.options import LearnedKind
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.compensation.learned_waveform import LearnedWaveformSettings
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.control.compensation.trapezoidal_pulse import FrictionCompensationSettings
from servo_ctrl.learned.file_model import LearnedFile
from servo_ctrl.learned.store import (
    LearnedStore,
    ScrewStore,
    StoreError,
    VersionEntry,
    VersionStore,
    WaveformStore,
    default_directory,
)
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.learning.types import Learned

STORES: dict[LearnedKind, type[VersionStore[Any]]] = {
    LearnedKind.PULSE: LearnedStore,
    LearnedKind.SCREW: ScrewStore,
    LearnedKind.WAVEFORM: WaveformStore,
}
MISSING = {
    LearnedKind.PULSE: "a learned pulse",
    LearnedKind.SCREW: "its learned screw",
    LearnedKind.WAVEFORM: "its learned waveform",
}
OF_KIND = {
    LearnedKind.PULSE: "",
    LearnedKind.SCREW: " of the screw",
    LearnedKind.WAVEFORM: " of the waveform",
}
SECTIONS = {
    LearnedKind.PULSE: FrictionCompensationSettings,
    LearnedKind.SCREW: ScrewCompensationSettings,
    LearnedKind.WAVEFORM: LearnedWaveformSettings,
}
"""Settings of the section that each kind belongs to."""


def open_store(machine: Path, directory: Path | None, kind: LearnedKind) -> VersionStore[Any]:
    """Open the store of one kind, in `directory` or beside the machine file. Raises ConfigError."""
    config = load_machine(machine)
    return STORES[kind](directory or default_directory(config), config)


def print_versions(machine: Path, directory: Path | None, axes: Sequence[str] | None) -> None:
    """Print a table of all versions of the axes (None: all axes), and a line for each unusable one."""
    config = load_machine(machine)
    directory = directory or default_directory(config)
    table = Table(
        title=f"learned by {config.machine.name}",
        title_justify="left",
        caption=str(directory),
        caption_justify="left",
        box=None,
        padding=(0, 2, 0, 0),
    )
    for heading in ("axis", "no.", "in use", "valid", "learned at", "learner", "strokes", "J um"):
        table.add_column(heading, justify="right" if heading in {"no.", "strokes"} else "left", no_wrap=True)
    problems = []
    for axis in axes or config.axes:
        for kind in LearnedKind:
            store = STORES[kind](directory, config)
            entries = store.versions(axis)
            if not entries and not _is_configured(config.axes[axis], kind):
                continue
            for entry in entries:
                table.add_row(axis, *_cells(entry))
                if entry.problem:
                    problems.append(f"axis {axis}, version {entry.version}: {entry.problem}")
            problems += _why_unused(store, axis, kind)
    Console(markup=False, highlight=False).print(table)
    for problem in problems:
        typer.echo(problem)


def _is_configured(axis: AxisConfig, kind: LearnedKind) -> bool:
    return axis.section(SECTIONS[kind]) is not None


def _why_unused(store: VersionStore[Any], axis: str, kind: LearnedKind) -> list[str]:
    try:
        if store.active(axis) is None:
            return [f"axis {axis}: no version{OF_KIND[kind]} is in use"]
    except StoreError as error:
        return [f"axis {axis} runs without {MISSING[kind]}: {error}"]
    return []


def _cells(entry: VersionEntry) -> list[str]:
    state = [f"{entry.version}", "yes" if entry.in_use else "no", "no" if entry.problem else "yes"]
    if entry.result is None:
        return state
    functions = entry.result.learned
    return [
        *state,
        entry.result.learned_at,
        functions.learner,
        f"{functions.strokes}",
        f"{functions.before_m * 1e6:.2f} -> {functions.after_m * 1e6:.2f}",
    ]


def print_version(store: VersionStore[Any], axis: str, version: int | None, *, as_json: bool) -> None:
    """Print one version (None: the one in use) in full. Raises StoreError if it is absent or damaged."""
    entry = _entry(store, axis, version)
    if entry.result is None:
        raise StoreError(f"axis {axis}, version {entry.version}: {entry.problem}")
    if as_json:
        typer.echo(json.dumps(entry.result.model_dump(mode="json"), indent=2))
        return
    console = Console(markup=False, highlight=False)
    for line in description(entry, entry.result):
        console.print(line)
    for table in tables_of(entry.result.learned.learned()):
        console.print(table)


def _entry(store: VersionStore[Any], axis: str, version: int | None) -> VersionEntry:
    entries = store.versions(axis)
    found = [entry for entry in entries if (entry.in_use if version is None else entry.version == version)]
    if found:
        return found[0]
    known = ", ".join(str(entry.version) for entry in entries) or "none"
    wanted = "no version is in use" if version is None else f"there is no version {version}"
    raise StoreError(f"{store.directory}: axis {axis}: {wanted}; versions: {known}")


def description(entry: VersionEntry, result: LearnedFile[Any]) -> list[str]:
    """Describe a version in lines: its origin, what it depends on, and its content."""
    functions = result.learned
    return [
        f"axis {result.axis} of {result.machine}, version {result.version}"
        + (", in use" if entry.in_use else ""),
        *([f"cannot be used: {entry.problem}"] if entry.problem else []),
        f"learned at {result.learned_at} by servo-ctrl {result.software}, learner {functions.learner}",
        f"{functions.strokes} strokes, {functions.machine_time_s / 60.0:.1f} min of machine time",
        f"J {functions.before_m * 1e6:.2f} um before, {functions.after_m * 1e6:.2f} um after",
        "depends on:",
        *(f"  {key} = {value}" for key, value in result.basis.items()),
        "conditions:",
        *(f"  {key} = {value}" for key, value in result.conditions.items()),
        _particulars(functions.learned()),
    ]


def _particulars(learned: Learned | ScrewLearned | WaveformLearned) -> str:
    if isinstance(learned, WaveformLearned):
        largest_n = max((abs(force) for wave in learned.waves_n for force in wave), default=0.0)
        *levels_n, per_speed_n_s_m, per_acceleration_kg, per_jerk_kg_s = learned.friction
        return (
            f"friction {sum(levels_n):.2f} N in presliding, {per_speed_n_s_m:.0f} N s/m, "
            f"{per_acceleration_kg:.2f} kg, {per_jerk_kg_s:.3f} kg s; waveforms up to {largest_n:.2f} N"
        )
    if isinstance(learned, ScrewLearned):
        least_m, most_m = min(row[2] for row in learned.points), max(row[2] for row in learned.points)
        over = f"{least_m * 1e6:.2f} to {most_m * 1e6:.2f} um over the travel"
        spread = f"spread {learned.spread_m * 1e6:.3f} um from travel to travel"
        return f"lost motion {learned.lost_motion_m * 1e6:.2f} um, {over}; {spread}"
    between = f"GRNN with spread {learned.spread_m_s2 * 1e3:.4g} mm/s^2" if learned.spread_m_s2 else "lines"
    return f"amplitude between the points: {between}"


def tables_of(learned: Learned | ScrewLearned | WaveformLearned) -> list[Table]:
    """Return tables of the points of a learned result."""
    if isinstance(learned, WaveformLearned):
        rows = [
            (f"{a * 1e3:.4g}", f"{min(wave):.3f}", f"{max(wave):.3f}")
            for a, wave in zip(learned.accelerations_m_s2, learned.waves_n, strict=True)
        ]
        rests = [
            (f"{rest_s:.4g}", f"{max(onward_n):.3f}", f"{max(turned_n):.3f}")
            for rest_s, onward_n, turned_n in learned.rests
        ]
        tables = [_points("waveform", ("a mm/s^2", "least N", "largest N"), rows)]
        headings = ("rest s", "largest N onward", "largest N turned")
        return [*tables, _points("behind rests", headings, rests)] if rests else tables
    if isinstance(learned, ScrewLearned):
        rows = [
            (f"{position_m * 1e3:.4f}", f"{error_m * 1e6:.3f}", f"{lost_m * 1e6:.3f}")
            for position_m, error_m, lost_m in learned.points
        ]
        return [_points("screw", ("position mm", "error um", "lost motion um"), rows)]
    return [
        _points(title, ("a mm/s^2", *headings), [[f"{value * 1e3:.4g}" for value in row] for row in points])
        for title, headings, points in (
            ("duration", ("T* ms",), learned.durations),
            ("amplitude", ("A* mm/s",), learned.amplitudes),
            ("second trapezoid", ("start ms", "duration ms", "amplitude mm/s"), learned.trailing),
        )
        if points
    ]


def _points(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    table = Table(
        *(Column(heading, justify="right") for heading in headings), title=title, title_justify="left"
    )
    for row in rows:
        table.add_row(*row)
    return table


def plot_in_use(
    machine: Path, directory: Path | None, axes: Sequence[str] | None, out: Path, kind: LearnedKind
) -> None:
    """Draw the versions in use of the axes (None: all axes). Raises StoreError if there are none."""
    from servo_ctrl.config.kernel_params import axis_params
    from servo_ctrl.config.learning import waveform_settings
    from servo_ctrl.plots.learned import LearnedAxis, plot_learned, plot_screws, plot_waveforms

    config = load_machine(machine)
    directory = directory or default_directory(config)
    store = STORES[kind](directory, config)
    in_use = [(axis, found) for axis in axes or config.axes if (found := store.active(axis)) is not None]
    if not in_use:
        raise StoreError(f"{directory}: no version is in use, there is nothing to draw")
    if kind is LearnedKind.SCREW:
        screws = {f"{axis}, version {found.version}": found.learned for axis, found in in_use}
        plot_screws(out, screws, f"{config.machine.name}: learned screws")
        return
    if kind is LearnedKind.WAVEFORM:
        waveforms = {f"{axis}, version {found.version}": found.learned for axis, found in in_use}
        loop = waveform_settings(config, in_use[0][0]).loop
        plot_waveforms(out, waveforms, loop, f"{config.machine.name}: learned waveforms")
        return
    pulses = [
        LearnedAxis(
            f"{axis}, version {found.version} ({found.learned.learner})",
            found.learned,
            axis_params(config, axis).pulse.amplitude_max_m_s,
        )
        for axis, found in in_use
    ]
    plot_learned(out, pulses, f"{config.machine.name}: learned friction compensation")
