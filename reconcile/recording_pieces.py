"""Where a recording has to be cut: gaps, missing values, a drive that is off or homing, jumps."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.errors import ReconcileError
from reconcile.sensing_finding import Finding
from reconcile.sensing_jumps import find_jumps
from reconcile.sensing_time import FILLED, NOTABLE, Grid, grid

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.formats.model_axis import ModelAxis
    from reconcile.sensing_time import Stamps

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]

NEEDED = ("position", "force", "scale", "reference")
"""Roles that must have a value in a row, where the recording has them at all."""
POSITIONS = ("position", "scale")
FIELDS = {"position": "motor_m", "scale": "scale_m", "force": "force_n", "reference": "reference_m"}
ENABLED_MASK, ENABLED = 0x6F, 0x27
HOMING_MODE = 6
MOST_JUMPS = 10
SMALL = 100
"""Rows too few to judge the evenness of; nobody uses such a piece."""


class Piece(NamedTuple):
    """Rows that lie together."""

    rows: slice
    grid: Grid
    repaired: dict[str, Array]
    """Channels (of all rows of the file) from which spikes were taken."""
    findings: tuple[Finding, ...]


class _Where(NamedTuple):
    source: str
    axis: str
    time_s: Array
    channels: dict[str, Array]
    model: ModelAxis

    def finding(self, check: str, role: str, first: int, last: int, size: float, unit: str) -> Finding:
        start_s, end_s = float(self.time_s[first]), float(self.time_s[last])
        channel = FIELDS.get(role, "")
        return Finding(check, "warning", self.source, self.axis, channel, start_s, end_s, size, unit, "")


def pieces_of(
    source: str, axis: str, time_s: Array, stamps: Stamps, channels: dict[str, Array], model: ModelAxis
) -> list[Piece]:
    """The pieces of an axis, with what was found in each. Raises ReconcileError."""
    where = _Where(source, axis, time_s, channels, model)
    valid = _valid(channels)
    repaired: dict[str, Array] = {}
    cuts: list[int] = [row for row in stamps.gaps.tolist() if stamps.missing(row) > FILLED]
    findings = [_gap(where, stamps, row) for row in stamps.gaps.tolist()]
    for role in POSITIONS:
        if role in channels:
            found, jump_rows, repaired_values = _jumps(where, role, valid, stamps)
            findings += found
            cuts += jump_rows
            if repaired_values is not None:
                repaired[role] = repaired_values
    edges = [0, *sorted(set(cuts)), len(time_s)]
    pieces = []
    for first, last in itertools.pairwise(edges):
        for start, stop in _stretches(valid[first:last]):
            rows = slice(first + start, first + stop)
            pieces.append(_piece(where, rows, stamps, repaired, valid, findings))
    return pieces


def _valid(channels: dict[str, Array]) -> Flags:
    valid = np.ones(len(channels["position"]), dtype=np.bool_)
    for role in NEEDED:
        present = np.isfinite(channels[role]) if role in channels else valid
        if present.any():
            valid = valid & present
    if "statusword" in channels:
        status = np.nan_to_num(channels["statusword"]).astype(np.int64)
        enabled = (status & ENABLED_MASK) == ENABLED
        valid = valid & enabled if enabled.any() else valid
    if "mode" in channels:
        valid = valid & (channels["mode"] != HOMING_MODE)
    return valid


def _stretches(valid: Flags) -> list[tuple[int, int]]:
    """(start, stop) of the valid rows, going on over a few invalid ones."""
    rows = np.flatnonzero(valid)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) > FILLED + 1)
    starts = [int(rows[0]), *rows[breaks + 1].tolist()]
    stops = [*(rows[breaks] + 1).tolist(), int(rows[-1]) + 1]
    return list(zip(starts, stops, strict=True))


def _piece(
    where: _Where, rows: slice, stamps: Stamps, repaired: dict[str, Array], valid: Flags, found: list[Finding]
) -> Piece:
    time_s = where.time_s[rows]
    position_m = repaired.get("position", where.channels["position"])[rows]
    if len(time_s) < SMALL:
        return Piece(rows, Grid(time_s, time_s, 0.0, resampled=False), repaired, ())
    lattice = grid(time_s, stamps.number[rows], position_m, where.source)
    own = [f for f in found if time_s[0] <= f.end_s and f.start_s <= time_s[-1]]
    holes = int(np.count_nonzero(~valid[rows]))
    if holes:
        first, last = rows.start, rows.stop - 1
        hole = where.finding("hole", "", first, last, float(holes), "samples")
        own.append(hole._replace(severity="note", message=f"{holes} rows without a value were filled in"))
    if lattice.jitter > NOTABLE or lattice.resampled:
        jitter = where.finding("jitter", "", rows.start, rows.stop - 1, 100.0 * lattice.jitter, "%")
        what = "the channels were resampled" if lattice.resampled else "the samples were taken to be even"
        message = f"the time stamps are uneven by {100.0 * lattice.jitter:.2g} % of a sample time; {what}"
        own.append(jitter._replace(severity="note", message=message))
    return Piece(rows, lattice, repaired, tuple(own))


def _gap(where: _Where, stamps: Stamps, row: int) -> Finding:
    lost = stamps.missing(row)
    finding = where.finding("gap", "", row - 1, row, float(lost), "samples")
    what = "filled in" if lost <= FILLED else "the recording is split there"
    message = f"{lost} samples are missing after {finding.start_s:.4f} s; {what}"
    return finding._replace(severity="note" if lost <= FILLED else "warning", message=message)


def _jumps(
    where: _Where, role: str, valid: Flags, stamps: Stamps
) -> tuple[list[Finding], list[int], Array | None]:
    values = np.where(valid, where.channels[role], np.nan)
    found = find_jumps(values, stamps.number, FILLED)
    if len(found.jumps) > MOST_JUMPS:
        first = int(found.jumps[0])
        raise ReconcileError(
            where.source,
            f"axis {where.axis}, {FIELDS[role]}, {where.time_s[first]:.4f} s",
            f"jumps {len(found.jumps)} times, first by {found.jump_m[0] * 1e3:.6g} mm",
            "is it a counter that wraps, of the wrong type or byte order, or two channels in one?",
        )
    findings = []
    for row, size_m in zip(found.jumps.tolist(), found.jump_m.tolist(), strict=True):
        finding = where.finding("jump", role, row - 1, row, size_m, "m")
        message = f"jumps by {size_m * 1e3:.6g} mm at {finding.end_s:.4f} s{_wrap(where.model, role, size_m)}"
        findings.append(finding._replace(message=f"{message}; the recording is split there"))
    if not len(found.spikes):
        return findings, found.jumps.tolist(), None
    repaired = where.channels[role].copy()
    repaired[found.spikes] = np.nan
    for row, size_m in zip(found.spikes.tolist(), found.spike_m.tolist(), strict=True):
        finding = where.finding("spike", role, row, row, size_m, "m")
        message = f"one sample is off by {size_m * 1e3:.6g} mm at {finding.start_s:.4f} s; it was filled in"
        findings.append(finding._replace(message=message))
    return findings, found.jumps.tolist(), repaired


def _wrap(model: ModelAxis, role: str, size_m: float) -> str:
    """What a jump by a power of two of the counts means."""
    count_m = model.encoder_resolution_m if role == "position" else model.scale_resolution_m
    for bits in (16, 24, 32):
        if count_m and abs(abs(size_m) / count_m / 2.0**bits - 1.0) < 0.01:
            return f" (a counter of {bits} bits that wraps?)"
    return " (was the encoder re-zeroed?)"
