"""Loads recordings of any format as evenly sampled, complete pieces by axis."""

from collections.abc import Mapping as ByName
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.formats.axis_channels import Channels, axis_channels, missing
from reconcile.formats.column_origin import ColumnOrigin
from reconcile.formats.files import recordings_of
from reconcile.formats.mapping import NO_MAPPING, Mapping
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.formats.readers import read_table
from reconcile.formats.table import Table, short_list
from reconcile.recording import time_column
from reconcile.recording.pieces import LEAST_PRESENT, REQUIRED_ROLES, Piece, pieces_of
from reconcile.recording.sensor_finding import SensorFinding, Severity

NOTED_SHARE = 0.1
"""Least share of a recording in too short stretches for a warning."""
SHORTEST_S, SHORTEST_ALONE_S, FEWEST_SAMPLES = 0.5, 0.25, 200
"""Least durations (s) and samples of a piece; shorter ones are dropped. The second duration applies where no
piece is as long as the first.
"""
MORE_TO_RECORD = (
    "record some seconds: a program with several strokes, reversals among them, at two speeds or more; rest "
    "alone tells nothing"
)


class AxisRecording(NamedTuple):
    """One axis over one stretch of time without a gap; all arrays (n,)."""

    source: str
    """File, for messages; with the range of time where the file was split."""
    axis: str
    period_s: float
    time_s: Array
    """Even, from 0."""
    motor_m: Array
    """Motor encoder, at the table."""
    force_n: Array
    """Measured motor force, at the table."""
    scale_m: Array | None
    reference_m: Array | None
    temperature_k: Array | None
    others: dict[str, Array]
    """Motor positions of the other axes of the same recording."""
    force_command_n: Array | None = None
    start_s: float = 0.0
    """Time of the first sample in the file."""
    findings: tuple[SensorFinding, ...] = ()
    """Defects found while reading: gaps, jitter, spikes."""
    ignored: tuple[str, ...] = ()
    """Columns of the file that were not used."""
    origins: ByName[str, ColumnOrigin] = {}
    """Role -> the column of its channel."""
    samples_in_a_mean: int = 1
    """Samples averaged into one of these; more than one to save memory."""
    mode: str = ""
    """In which the drive was led (`csp`, `csv`, `cst`); empty where nothing says so."""


def load_recordings(
    paths: Sequence[Path],
    model: ByName[str, NominalAxis],
    mapping: Mapping = NO_MAPPING,
    *,
    set_aside: bool = True,
) -> list[AxisRecording]:
    """Load every axis of the model from every file, folder or pattern, split where samples are missing.

    A file that cannot be used among good ones is set aside, which a finding of the first good one reports;
    without `set_aside` it raises.

    Raises:
        ReconcileError: no file can be used; the first one's place, and what to do.

    """
    found: list[AxisRecording] = []
    refused: list[ReconcileError] = []
    for path in recordings_of(paths):
        try:
            found += _load(path, model, mapping)
        except ReconcileError as error:
            refused.append(error)
    if refused and not (found and set_aside):
        raise refused[0]
    if refused:
        aside = tuple(_set_aside(error) for error in refused)
        found[0] = found[0]._replace(findings=(*found[0].findings, *aside))
    return found


def _load(path: Path, model: ByName[str, NominalAxis], mapping: Mapping) -> list[AxisRecording]:
    """Load every axis of the model from one file. Raises ReconcileError."""
    table = read_table(path, mapping, model)
    channels = axis_channels(table, mapping, model)
    axes_present = [name for name in model if name in channels.axes]
    if not axes_present:
        present = short_list(channels.axes) if channels.axes else f"columns {short_list(table.columns)}"
        reason = f"holds none of the model's axes ({short_list(model)}); it has {present}"
        raise ReconcileError(path, "", reason, "name the columns: --map position=NAME,force=NAME")
    found = [one for name in axes_present for one in _axis_recordings(table, channels, name, model[name])]
    found = [one._replace(mode=table.modes.get(one.axis, "")) for one in found]
    if table.skipped:
        found[0] = found[0]._replace(findings=(*found[0].findings, _skipped(table)))
    return found


def _skipped(table: Table) -> SensorFinding:
    message = f"{table.skipped}: the log is read as the classic CAN that CANopen is"
    return SensorFinding(
        check="skipped",
        severity="note",
        source=table.source,
        message=message,
        remedy="record the classic bus alone",
    )


def _set_aside(error: ReconcileError) -> SensorFinding:
    place = f"{error.where}: " if error.where else ""
    message = f"the recording is set aside: {place}{error.reason}"
    return SensorFinding(
        check="unreadable", severity="warning", source=error.file, message=message, remedy=error.remedy
    )


def _axis_recordings(table: Table, channels: Channels, axis: str, model: NominalAxis) -> list[AxisRecording]:
    roles = channels.axes[axis]
    if "position" not in roles or "force" not in roles:
        raise missing(roles, axis, table)
    stamps = time_column.read_time_column(channels.time_s, table.source, table.first_row)
    pieces = pieces_of(table.source, axis, time_s=channels.time_s, stamps=stamps, channels=roles, model=model)
    lasting_s = [
        float(np.ptp(p.grid.time_s)) if len(p.grid.time_s) >= FEWEST_SAMPLES else 0.0 for p in pieces
    ]
    least_s = SHORTEST_S if max(lasting_s, default=0.0) >= SHORTEST_S else SHORTEST_ALONE_S
    is_usable = [one_s >= least_s for one_s in lasting_s]
    usable_pieces = [p for p, usable in zip(pieces, is_usable, strict=True) if usable]
    if not usable_pieces:
        times = [piece.grid.time_s for piece in pieces]
        longest_s, samples = max(((float(np.ptp(of)), len(of)) for of in times), default=(0.0, 0))
        has = f"{longest_s:.3f} s, {samples} samples"
        needed = f"{SHORTEST_ALONE_S} s and {FEWEST_SAMPLES} samples"
        reason = f"has no unbroken stretch of {needed}; the longest is {has}"
        remedy = "are position and force valid (not NaN), and the drive switched on, in the same rows?"
        if samples == len(channels.time_s) and all(np.isfinite(roles[r]).all() for r in REQUIRED_ROLES):
            remedy = MORE_TO_RECORD
        raise ReconcileError(table.source, f"axis {axis}", reason, remedy)
    split = len(pieces) > 1
    first, *others = (
        _axis_recording(table.source, channels, axis, piece, split=split) for piece in usable_pieces
    )
    short = [p for p, usable in zip(pieces, is_usable, strict=True) if not usable]
    if short:
        first = first._replace(findings=(*first.findings, _left_out(table.source, axis, pieces, short)))
    return [first, *others]


def _left_out(source: str, axis: str, pieces: Sequence[Piece], short: Sequence[Piece]) -> SensorFinding:
    """Return the finding of stretches that are too short for a diagnosis."""
    whole_s, lost_s = (sum(float(np.ptp(p.grid.time_s)) for p in of) for of in (pieces, short))
    share = lost_s / max(whole_s, 1e-300)
    message = (
        f"{len(short)} stretches between gaps, {lost_s:.3g} s in all ({100.0 * share:.2g} %), are left out: "
        f"they are shorter than {SHORTEST_S} s or {FEWEST_SAMPLES} samples"
    )
    severity: Severity = "warning" if share > NOTED_SHARE else "note"
    return SensorFinding(
        check="short",
        severity=severity,
        source=source,
        axis=axis,
        size=lost_s,
        unit="s",
        message=message,
        remedy="record without gaps",
    )


def _axis_recording(
    source: str, channels: Channels, axis: str, piece: Piece, *, split: bool
) -> AxisRecording:
    grid = piece.grid

    def channel(role: str, *, smooth: bool, of: str = axis) -> Array | None:
        values = channels.axes[of].get(role)
        if values is None:
            return None
        values = piece.repaired.get(role, values) if of == axis else values
        values = values[piece.rows]
        if np.isfinite(values).mean() < LEAST_PRESENT:
            return None
        return time_column.on_grid(grid, values, smooth=smooth)

    motor_m, force_n = channel("position", smooth=True), channel("force", smooth=False)
    if motor_m is None or force_n is None:
        raise ReconcileError(source, f"axis {axis}", "has no motor position or force")
    others = {name: channel("position", smooth=True, of=name) for name in channels.axes if name != axis}
    start_s, end_s = float(grid.time_s[0]), float(grid.time_s[-1])
    period_s = round((end_s - start_s) / (len(grid.time_s) - 1), 12)
    return AxisRecording(
        source=f"{source} [{start_s:.3f} to {end_s:.3f} s]" if split else source,
        axis=axis,
        period_s=period_s,
        time_s=np.arange(len(grid.time_s), dtype=np.float64) * period_s,
        motor_m=motor_m,
        force_n=force_n,
        scale_m=channel("scale", smooth=True),
        reference_m=channel("reference", smooth=True),
        temperature_k=channel("temperature", smooth=False),
        others={name: values for name, values in others.items() if values is not None},
        force_command_n=channel("force_command", smooth=False),
        start_s=start_s,
        findings=piece.findings,
        ignored=channels.unknown,
        origins=channels.origins.get(axis, {}),
    )
