"""Columns from a log of the CAN bus: the PDOs of the drives and scales in the model file.

A row is a SYNC period, because PDOs until the next SYNC carry values latched by it or computed from those.
The PDO mapping is that of the EDS, changed by the SDO downloads in the log. If the log begins after the boot,
an entry of `--map` states where a value is: `x.position=0x181@2:i32` (identifier, byte, type), in device
units unless it has a factor.
"""

import math
import re
from collections.abc import Mapping as ByName
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.formats.candump_frames import Frames, read_frames
from reconcile.formats.eds_pdos import Pdo, pdos_of
from reconcile.formats.mapping import MapEntry, Mapping
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.formats.quantities import ROLES
from reconcile.formats.table import Column, Table

PAYLOAD_PLACE = re.compile(r"(0x[0-9A-Fa-f]{1,3})@([0-7]):([iu](?:8|16|32))")
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
"""Objects of the drive (CiA 402). Of two objects with one role the first is used."""
TORQUE_OFFSET = (0x60B2, 0)
SCALE_POSITION = (0x6004, 0)
"""Position value of the scale (CiA 406)."""
SUFFIX = {"length": "_m", "force": "_n", "current": "_a", "number": ""}
COUNTER_RANGE = 2.0**32


class _Decoded(NamedTuple):
    frames: Frames
    path: Path
    mapped: bool
    """`--map` states where values are, so PDOs that do not fit the EDS are skipped."""


def read(path: Path, mapping: Mapping, model: ByName[str, NominalAxis]) -> Table:
    """Read columns such as `<axis>.motor_position_m`, in SI. Raises ReconcileError."""
    mapped = {entry.column: entry for entry in mapping.entries if PAYLOAD_PLACE.fullmatch(entry.column)}
    log = _Decoded(read_frames(path), path, bool(mapped))
    columns = {"time_s": Column(log.frames.sync_s, "s")}
    for name, entry in mapped.items():
        columns[name] = Column(_mapped_values(log, entry, model))
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
    fd = log.frames.skipped_fd
    return Table(str(path), columns, skipped=f"{fd} frames of CAN FD are skipped" if fd else "")


def _drive_columns(log: _Decoded, pdos: list[Pdo], name: str, axis: NominalAxis) -> dict[str, Column]:
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
    """Return the values of every mapped object by SYNC period; NaN without a frame."""
    values: dict[tuple[int, int], Array] = {}
    for pdo in pdos:
        frames = log.frames.payloads.get(pdo.cob_id, {})
        size = pdo.layout.itemsize
        fitting = {period: data for period, data in frames.items() if len(data) == size}
        if 2 * len(fitting) < len(frames) and log.mapped:
            continue
        if 2 * len(fitting) < len(frames):
            reason = f"most frames are not of the {size} bytes that the mapping has"
            remedy = "record from the boot on, or use --map (0x181@2:i32)"
            raise ReconcileError(log.path, f"PDO {pdo.cob_id:03X}h", reason, remedy)
        rows = np.fromiter(fitting, dtype=np.intp, count=len(fitting))
        payloads = b"".join(fitting.values())
        for position, address in enumerate(pdo.objects):
            if pdo.layout[position].kind != "V" and len(rows):
                values[address] = _over_syncs(log, rows, pdo.values(payloads, position))
    return values


def _mapped_values(log: _Decoded, entry: MapEntry, model: ByName[str, NominalAxis]) -> Array:
    """Return the values of an entry such as `0x181@2:i32`."""
    match = PAYLOAD_PLACE.fullmatch(entry.column)
    if match is None:
        raise ReconcileError("--map", str(entry), "is not of the form 0x181@2:i32")
    cob_id, first_byte, number_type = int(match[1], 16), int(match[2]), match[3]
    dtype = np.dtype(f"<{number_type[0]}{int(number_type[1:]) // 8}")
    fitting = {
        period: data[first_byte : first_byte + dtype.itemsize]
        for period, data in log.frames.payloads.get(cob_id, {}).items()
        if len(data) >= first_byte + dtype.itemsize
    }
    if not fitting:
        reason = f"no frame has a {number_type} at byte {first_byte}"
        raise ReconcileError(log.path, f"{cob_id:03X}h", reason, f"see {entry}")
    rows = np.fromiter(fitting, dtype=np.intp, count=len(fitting))
    raw = np.frombuffer(b"".join(fitting.values()), dtype=dtype).astype(np.float64)
    values = _over_syncs(log, rows, raw)
    if number_type.endswith("32"):
        values = _unwrapped(values)
    if entry.factor is not None:
        return values
    axis = model.get(entry.axis) if entry.axis else next(iter(model.values()), None)
    unit = _si_per_count(axis, entry.role) if axis is not None else None
    if unit is None:
        reason = "the model file does not say what a count is"
        raise ReconcileError("--map", str(entry), reason, "give a factor")
    return values * unit


def _si_per_count(axis: NominalAxis, role: str) -> float | None:
    """Return the SI value of one device unit; None where the model does not define it."""
    rating_plate = axis.bus
    per_mille_n = rating_plate.rated_torque_nm * 1e-3 * 2.0 * math.pi / axis.lead_m if rating_plate else None
    si_per_count = {
        "position": axis.encoder_resolution_m,
        "reference": axis.encoder_resolution_m,
        "scale": axis.scale_resolution_m,
        "current": rating_plate.rated_current_a * 1e-3 if rating_plate else None,
        "force": per_mille_n,
        "force_command": per_mille_n,
        "statusword": 1.0,
        "mode": 1.0,
    }
    return si_per_count.get(role)


def _over_syncs(log: _Decoded, rows: NDArray[np.intp], values: Array) -> Array:
    over = np.full(len(log.frames.sync_s), np.nan)
    over[rows] = values
    return over


def _unwrapped(values: Array) -> Array:
    """Unwrap a 32-bit counter."""
    present = np.isfinite(values)
    unwrapped = values.copy()
    unwrapped[present] = np.unwrap(values[present], period=COUNTER_RANGE)
    return unwrapped
