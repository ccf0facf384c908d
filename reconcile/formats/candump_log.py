"""A log of the CAN bus into columns: the PDOs of the drives and scales that the model file names.

A row is a SYNC: PDOs until the next SYNC carry what was latched by it, or was computed from that. The
mappings are those of the EDS, changed by the SDO downloads that the log itself holds. Where it begins after
the boot, an entry of `--map` says where a value is: `x.position=0x181@2:i32` (identifier, byte, type), in
device units unless it has a factor.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.errors import ReconcileError
from reconcile.formats.candump_frames import read_frames
from reconcile.formats.eds_pdos import Pdo, pdos_of
from reconcile.formats.quantities import ROLES
from reconcile.formats.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Mapping as ByName
    from pathlib import Path

    from numpy.typing import NDArray

    from reconcile.formats.candump_frames import Frames
    from reconcile.formats.mapping import MapEntry, Mapping
    from reconcile.formats.model_axis import ModelAxis

    Array = NDArray[np.float64]

PLACE = re.compile(r"(0x[0-9A-Fa-f]{1,3})@([0-7]):([iu](?:8|16|32))")
ROLE_OF_OBJECT: dict[tuple[int, int], str] = {
    (0x6064, 0): "position",
    (0x6077, 0): "force",
    (0x6078, 0): "current",
    (0x6071, 0): "force_command",
    (0x607A, 0): "reference",
    (0x6041, 0): "statusword",
    (0x6061, 0): "mode",
    (0x6060, 0): "mode",
}
"""Objects of the drive (CiA 402). The later of two with one role does not replace the earlier."""
TORQUE_OFFSET = (0x60B2, 0)
SCALE_POSITION = (0x6004, 0)
"""Of the scale (CiA 406)."""
SUFFIX = {"length": "_m", "force": "_n", "current": "_a", "number": ""}
WRAP = 2.0**32


class _Decoded(NamedTuple):
    frames: Frames
    path: Path
    placed: bool
    """`--map` says where values are: PDOs that do not fit the EDS are passed over."""


def read(path: Path, mapping: Mapping, model: ByName[str, ModelAxis]) -> Table:
    """Columns `<axis>.motor_position_m` and so on in SI. Raises ReconcileError."""
    placed = {entry.column: entry for entry in mapping.entries if PLACE.fullmatch(entry.column)}
    log = _Decoded(read_frames(path), path, bool(placed))
    columns = {"time_s": Column(log.frames.sync_s, "s")}
    for name, entry in placed.items():
        columns[name] = Column(_placed(log, entry, model))
    for name, axis in model.items():
        if axis.bus is None:
            continue
        nodes = axis.bus
        pdos = pdos_of(nodes.drive_eds, nodes.drive_node_id, log.frames.written.get(nodes.drive_node_id, {}))
        columns |= _drive_columns(log, pdos, name, axis)
        if nodes.scale_node_id is not None and nodes.scale_eds is not None and axis.scale_resolution_m:
            written = log.frames.written.get(nodes.scale_node_id, {})
            raw = _objects(log, pdos_of(nodes.scale_eds, nodes.scale_node_id, written)).get(SCALE_POSITION)
            if raw is not None:
                columns[f"{name}.scale_position_m"] = Column(_unwrapped(raw) * axis.scale_resolution_m, "m")
    if len(columns) == 1:
        remedy = "record from the boot on, or say where it is: --map x.position=0x181@2:i32"
        raise ReconcileError(path, "", "carries no position of an axis that the model file names", remedy)
    return Table(str(path), columns)


def _drive_columns(log: _Decoded, pdos: list[Pdo], name: str, axis: ModelAxis) -> dict[str, Column]:
    columns: dict[str, Column] = {}
    raw = _objects(log, pdos)
    for address, role in ROLE_OF_OBJECT.items():
        if address not in raw:
            continue
        values = raw[address]
        if address == (0x6071, 0) and TORQUE_OFFSET in raw:
            values = values + raw[TORQUE_OFFSET]
        dimension = ROLES[role].dimension
        values = _unwrapped(values) if dimension == "length" else values
        unit = _si_per_count(axis, role)
        if unit:
            column = f"{name}.{ROLES[role].stems[0]}{SUFFIX[dimension]}"
            columns.setdefault(column, Column(values * unit, SUFFIX[dimension][1:]))
    return columns


def _objects(log: _Decoded, pdos: list[Pdo]) -> dict[tuple[int, int], Array]:
    """Every mapped object over the SYNCs; NaN where no frame came."""
    values: dict[tuple[int, int], Array] = {}
    for pdo in pdos:
        frames = log.frames.payloads.get(pdo.cob_id, {})
        size = pdo.layout.itemsize
        fitting = {period: data for period, data in frames.items() if len(data) == size}
        if 2 * len(fitting) < len(frames) and log.placed:
            continue
        if 2 * len(fitting) < len(frames):
            reason = f"most frames are not of the {size} bytes that the mapping has"
            raise ReconcileError(
                log.path,
                f"PDO {pdo.cob_id:03X}h",
                reason,
                "record from the boot on, or use --map (0x181@2:i32)",
            )
        rows = np.fromiter(fitting, dtype=np.intp, count=len(fitting))
        payloads = b"".join(fitting.values())
        for position, address in enumerate(pdo.objects):
            if pdo.layout[position].kind != "V" and len(rows):
                values[address] = _over_syncs(log, rows, pdo.values(payloads, position))
    return values


def _placed(log: _Decoded, entry: MapEntry, model: ByName[str, ModelAxis]) -> Array:
    """The values of `0x181@2:i32`."""
    match = PLACE.fullmatch(entry.column)
    if match is None:
        raise ReconcileError("--map", str(entry), "is not of the form 0x181@2:i32")
    cob_id, first, kind = int(match[1], 16), int(match[2]), match[3]
    dtype = np.dtype(f"<{kind[0]}{int(kind[1:]) // 8}")
    fitting = {
        period: data[first : first + dtype.itemsize]
        for period, data in log.frames.payloads.get(cob_id, {}).items()
        if len(data) >= first + dtype.itemsize
    }
    if not fitting:
        raise ReconcileError(
            log.path, f"{cob_id:03X}h", f"no frame has a {kind} at byte {first}", f"see {entry}"
        )
    rows = np.fromiter(fitting, dtype=np.intp, count=len(fitting))
    raw = np.frombuffer(b"".join(fitting.values()), dtype=dtype).astype(np.float64)
    values = _over_syncs(log, rows, raw)
    if kind.endswith("32"):
        values = _unwrapped(values)
    if entry.factor is not None:
        return values
    axis = model.get(entry.axis) if entry.axis else next(iter(model.values()), None)
    unit = _si_per_count(axis, entry.role) if axis is not None else None
    if unit is None:
        raise ReconcileError(
            "--map", str(entry), "the model file does not say what a count is", "give a factor"
        )
    return values * unit


def _si_per_count(axis: ModelAxis, role: str) -> float | None:
    """SI of one device unit; None where the model does not say."""
    plate = axis.bus
    per_mille_n = plate.rated_torque_nm * 1e-3 * 2.0 * math.pi / axis.lead_m if plate else None
    known = {
        "position": axis.encoder_resolution_m,
        "reference": axis.encoder_resolution_m,
        "scale": axis.scale_resolution_m,
        "current": plate.rated_current_a * 1e-3 if plate else None,
        "force": per_mille_n,
        "force_command": per_mille_n,
        "statusword": 1.0,
        "mode": 1.0,
    }
    return known.get(role)


def _over_syncs(log: _Decoded, rows: NDArray[np.intp], values: Array) -> Array:
    over = np.full(len(log.frames.sync_s), np.nan)
    over[rows] = values
    return over


def _unwrapped(values: Array) -> Array:
    """A 32-bit counter without its wraps."""
    present = np.isfinite(values)
    unwrapped = values.copy()
    unwrapped[present] = np.unwrap(values[present], period=WRAP)
    return unwrapped
