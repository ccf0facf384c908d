"""Cuts a recording into pieces at gaps, missing values, jumps, and where the drive is off or homing."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.position_jumps import find_jumps
from reconcile.recording.sensor_finding import SensorFinding
from reconcile.recording.time_column import FILLED, NOTED_JITTER, Grid, Stamps, grid

Flags = NDArray[np.bool_]

COMPLETE_ROLES = ("position", "force", "scale", "reference")
"""Roles that must have a value in every row, if the recording has them."""
REQUIRED_ROLES = ("position", "force")
POSITIONS = ("position", "scale")
FIELDS = {"position": "motor_m", "scale": "scale_m", "force": "force_n", "reference": "reference_m"}
ENABLED_MASK, ENABLED = 0x6F, 0x27
"""Statusword of Operation enabled (CiA 402-2)."""
HOMING_MODE = 6
"""modes_of_operation of homing (CiA 402-2)."""
MOST_JUMPS = 10
"""Most jumps of a position; with more the column is wrong, and the file is refused."""
LEAST_PRESENT = 0.5
"""Least share of rows with a value of a channel; with less it counts as not recorded."""
FEWEST_ROWS = 100
"""Least rows of a piece; with fewer its evenness cannot be estimated, and it is dropped."""


class Piece(NamedTuple):
    """Consecutive rows on an even time grid."""

    rows: slice
    grid: Grid
    repaired: dict[str, Array]
    """Channels without their spikes, (all rows of the file,)."""
    findings: tuple[SensorFinding, ...]


class _AxisChannels(NamedTuple):
    source: str
    axis: str
    time_s: Array
    channels: dict[str, Array]
    model: NominalAxis

    def finding(self, check: str, role: str, first: int, last: int, size: float, unit: str) -> SensorFinding:
        return SensorFinding(
            check=check,
            severity="warning",
            source=self.source,
            axis=self.axis,
            channel=FIELDS.get(role, ""),
            start_s=float(self.time_s[first]),
            end_s=float(self.time_s[last]),
            size=size,
            unit=unit,
        )


def pieces_of(
    source: str, axis: str, time_s: Array, stamps: Stamps, channels: dict[str, Array], model: NominalAxis
) -> list[Piece]:
    """Cut the rows of an axis into pieces with the findings in each. Raises ReconcileError."""
    source_rows = _AxisChannels(source, axis, time_s, channels, model)
    valid = _valid_rows(channels)
    repaired: dict[str, Array] = {}
    cuts: list[int] = [row for row in stamps.gaps.tolist() if stamps.missing(row) > FILLED]
    findings = [_gap(source_rows, stamps, row) for row in stamps.gaps.tolist()]
    for role in POSITIONS:
        if role in channels:
            found, jump_rows, repaired_values = _jumps(source_rows, role, valid, stamps)
            findings += found
            cuts += jump_rows
            if repaired_values is not None:
                repaired[role] = repaired_values
    edges = [0, *sorted(set(cuts)), len(time_s)]
    pieces = []
    for first, last in itertools.pairwise(edges):
        for start, stop in _stretches(valid[first:last]):
            rows = slice(first + start, first + stop)
            pieces.append(
                _piece(source_rows, rows, stamps=stamps, repaired=repaired, valid=valid, found=findings)
            )
    return pieces


def _valid_rows(channels: dict[str, Array]) -> Flags:
    valid = np.ones(len(channels["position"]), dtype=np.bool_)
    for role in COMPLETE_ROLES:
        present = np.isfinite(channels[role]) if role in channels else valid
        if role in REQUIRED_ROLES or present.mean() >= LEAST_PRESENT:
            valid = valid & present
    if "statusword" in channels:
        status = np.nan_to_num(channels["statusword"]).astype(np.int64)
        enabled = (status & ENABLED_MASK) == ENABLED
        valid = valid & enabled if enabled.any() else valid
    if "mode" in channels:
        valid = valid & (channels["mode"] != HOMING_MODE)
    return valid


def _stretches(valid: Flags) -> list[tuple[int, int]]:
    """Return (start, stop) of stretches of valid rows, which may include up to FILLED invalid ones."""
    rows = np.flatnonzero(valid)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) > FILLED + 1)
    starts = [int(rows[0]), *rows[breaks + 1].tolist()]
    stops = [*(rows[breaks] + 1).tolist(), int(rows[-1]) + 1]
    return list(zip(starts, stops, strict=True))


def _piece(
    source_rows: _AxisChannels,
    rows: slice,
    stamps: Stamps,
    repaired: dict[str, Array],
    valid: Flags,
    found: list[SensorFinding],
) -> Piece:
    time_s = source_rows.time_s[rows]
    position_m = repaired.get("position", source_rows.channels["position"])[rows]
    if len(time_s) < FEWEST_ROWS:
        return Piece(rows, Grid(time_s, time_s, 0.0, resampled=False), repaired, ())
    even_grid = grid(time_s, stamps.number[rows], position_m, source_rows.source)
    own_findings = [f for f in found if time_s[0] <= f.end_s and f.start_s <= time_s[-1]]
    holes = int(np.count_nonzero(~valid[rows]))
    if holes:
        first, last = rows.start, rows.stop - 1
        hole = source_rows.finding("hole", "", first=first, last=last, size=float(holes), unit="samples")
        own_findings.append(
            hole._replace(severity="note", message=f"{holes} rows without a value were filled in")
        )
    if even_grid.jitter > NOTED_JITTER or even_grid.resampled:
        jitter = source_rows.finding(
            "jitter", "", first=rows.start, last=rows.stop - 1, size=100.0 * even_grid.jitter, unit="%"
        )
        what = "the channels were resampled" if even_grid.resampled else "the samples were taken to be even"
        message = f"the time stamps are uneven by {100.0 * even_grid.jitter:.2g} % of a sample time; {what}"
        own_findings.append(jitter._replace(severity="note", message=message))
    return Piece(rows, even_grid, repaired, tuple(own_findings))


def _gap(source_rows: _AxisChannels, stamps: Stamps, row: int) -> SensorFinding:
    lost = stamps.missing(row)
    finding = source_rows.finding("gap", "", first=row - 1, last=row, size=float(lost), unit="samples")
    what = "filled in" if lost <= FILLED else "the recording is split there"
    message = f"{lost} samples are missing after {finding.start_s:.4f} s; {what}"
    return finding._replace(severity="note" if lost <= FILLED else "warning", message=message)


def _jumps(
    source_rows: _AxisChannels, role: str, valid: Flags, stamps: Stamps
) -> tuple[list[SensorFinding], list[int], Array | None]:
    values = np.where(valid, source_rows.channels[role], np.nan)
    found = find_jumps(values, stamps.number, FILLED)
    if len(found.jumps) > MOST_JUMPS:
        first = int(found.jumps[0])
        where = f"axis {source_rows.axis}, {FIELDS[role]}, {source_rows.time_s[first]:.4f} s"
        reason = f"jumps {len(found.jumps)} times, first by {found.jump_m[0] * 1e3:.6g} mm"
        remedy = "is it a counter that wraps, of the wrong type or byte order, or two channels in one?"
        raise ReconcileError(source_rows.source, where, reason, remedy)
    findings = []
    for row, size_m in zip(found.jumps.tolist(), found.jump_m.tolist(), strict=True):
        finding = source_rows.finding("jump", role, first=row - 1, last=row, size=size_m, unit="m")
        message = (
            f"jumps by {size_m * 1e3:.6g} mm at {finding.end_s:.4f} s{_wrap(source_rows.model, role, size_m)}"
        )
        findings.append(finding._replace(message=f"{message}; the recording is split there"))
    if not len(found.spikes):
        return findings, found.jumps.tolist(), None
    repaired = source_rows.channels[role].copy()
    repaired[found.spikes] = np.nan
    for row, size_m in zip(found.spikes.tolist(), found.spike_m.tolist(), strict=True):
        finding = source_rows.finding("spike", role, first=row, last=row, size=size_m, unit="m")
        message = f"one sample is off by {size_m * 1e3:.6g} mm at {finding.start_s:.4f} s; it was filled in"
        findings.append(finding._replace(message=message))
    return findings, found.jumps.tolist(), repaired


def _wrap(model: NominalAxis, role: str, size_m: float) -> str:
    """Return a hint on the cause of a jump: a wrapping counter for a power of two of counts."""
    count_m = model.encoder_resolution_m if role == "position" else model.scale_resolution_m
    for bits in (16, 24, 32):
        if count_m and abs(abs(size_m) / count_m / 2.0**bits - 1.0) < 0.01:
            return f" (a counter of {bits} bits that wraps?)"
    return " (was the encoder re-zeroed?)"
