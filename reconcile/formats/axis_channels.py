"""Converts columns of a file to channels of an axis in SI, by the mapping of the user and by column names."""

from collections.abc import Mapping as ByName
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.formats.column_origin import ColumnOrigin
from reconcile.formats.mapping import MapEntry, Mapping
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.formats.quantities import (
    ANGULAR,
    REQUIRED,
    ROLES,
    TORQUES,
    UNITS,
    Role,
    normal_unit,
    unit_of_name,
)
from reconcile.formats.table import Column, Table, short_list

DEFAULT_AXIS = "x"
SHARED_ROLES = ("time", "temperature")
"""Roles whose column without an axis prefix is valid for every axis."""


class SiValues(NamedTuple):
    """A column in SI, and its conversion factor."""

    values: Array
    factor: float = 1.0


ColumnOfRole = tuple[str, str, str, SiValues]
"""Axis (empty without a prefix), role, column, values in SI."""


class Channels(NamedTuple):
    """The channels of a file; all arrays have the same length, in SI; NaN is a missing value."""

    time_s: Array
    axes: dict[str, dict[str, Array]]
    """Axis -> role -> values; `force` is computed from current or voltage where the model allows it."""
    unknown: tuple[str, ...]
    """Columns that were not used."""
    origins: dict[str, dict[str, ColumnOrigin]] = {}  # noqa: RUF012 never written to
    """Axis -> role -> the column that it was read from."""


def axis_channels(table: Table, mapping: Mapping, model: ByName[str, NominalAxis]) -> Channels:
    """Assign columns to axes and roles, in SI. Raises ReconcileError naming the column."""
    default = next(iter(model)) if len(model) == 1 else DEFAULT_AXIS
    named, unknown = _by_name(table, mapping)
    axes: dict[str, dict[str, Array]] = {}
    origin: dict[str, dict[str, str]] = {}
    shared: dict[str, Array] = {}
    mapped = [(entry.axis, entry.role, entry.column, _mapped(table, entry)) for entry in mapping.entries]
    origins: dict[str, dict[str, ColumnOrigin]] = {}
    for prefix, role_name, column, of in [*named, *mapped]:
        if role_name in SHARED_ROLES and not prefix:
            shared[role_name] = of.values
        else:
            axes.setdefault(prefix or default, {})[role_name] = of.values
            origin.setdefault(prefix or default, {})[role_name] = column
            origins.setdefault(prefix or default, {})[role_name] = ColumnOrigin(column, of.factor)
    time_s = _time(table, mapping, shared.pop("time", None), axes)
    axes = {name: shared | channels for name, channels in axes.items()}
    _check_lengths(table, time_s, axes, origin)
    if len(model) == 1 and len(axes) == 1 and default not in axes:
        axes = {default: axes.popitem()[1]}
        origins = dict.fromkeys((default,), next(iter(origins.values()), {}))
    _check_angles(table, mapping, origin, model)
    constant = _force_per_volt(table, mapping)
    for name, channels in axes.items():
        if name in model:
            _add_force(channels, model[name], constant)
    return Channels(time_s, axes, (*unknown, *table.ignored), origins)


def _by_name(table: Table, mapping: Mapping) -> tuple[list[ColumnOfRole], list[str]]:
    """Return the columns with a role by their name, and the names of the others."""
    mapped = {entry.column for entry in mapping.entries}
    found: list[ColumnOfRole] = []
    unknown: list[str] = []
    for name in [*table.columns, *table.text_columns]:
        prefix, _, stem = name.rpartition(".")
        role = _role_of(stem, table.columns.get(name))
        if role is not None and name not in mapped:
            found.append((prefix, role.name, name, _si(table, name, role)))
        elif name not in mapped:
            unknown.append(name)
    return found, unknown


def _role_of(name: str, column: Column | None) -> Role | None:
    """Return the role of a column by its name; None without a role or a unit."""
    stem, unit, dimension = unit_of_name(name)
    for role in ROLES.values():
        if stem.lower() not in role.stems:
            continue
        if role.dimension in {dimension, "number"} or role.name == "time":
            return role
        if unit in UNITS[role.dimension]:
            return role
        if not unit and column is not None and normal_unit(column.unit) in UNITS[role.dimension]:
            return role
    return None


def _mapped(table: Table, entry: MapEntry) -> SiValues:
    if entry.column not in table.columns and entry.column not in table.text_columns:
        names = short_list([*table.columns, *table.text_columns])
        raise ReconcileError(
            table.source, f"--map {entry}", f"has no column {entry.column!r}; it has: {names}"
        )
    if entry.factor is not None:
        return SiValues(_numbers(table, entry.column).values * entry.factor, entry.factor)
    return _si(table, entry.column, ROLES[entry.role])


def _numbers(table: Table, name: str) -> Column:
    """Return a column of numbers. Raises ReconcileError with the first row that holds none."""
    if name in table.columns:
        return table.columns[name]
    for index, cell in enumerate(table.text_columns[name]):
        try:
            float(cell)
        except ValueError:
            where = f"{table.row(index)}, column {name!r}"
            raise ReconcileError(table.source, where, f"{cell!r} is not a number") from None
    raise ReconcileError(table.source, f"column {name!r}", "holds no numbers")


def _si(table: Table, name: str, role: Role) -> SiValues:
    """Return a column in SI, by the unit of the file, else by that in its name, else unchanged."""
    column = _numbers(table, name)
    units = UNITS[role.dimension]
    _, unit, _ = unit_of_name(name)
    file_unit = normal_unit(column.unit)
    remedy = f"say what is right: --map {role.name}={name}*FACTOR (to SI)"
    if role.dimension == "number":
        return SiValues(column.values)
    if file_unit not in {"", "-", "1"}:
        if file_unit not in units:
            reason = f"its unit {column.unit!r} is none of a {role.dimension}"
            raise ReconcileError(table.source, f"column {name!r}", reason, remedy)
        if unit and unit in units and units[unit] != units[file_unit]:
            reason = f"its unit is {column.unit!r}, but its name ends in _{unit}"
            raise ReconcileError(table.source, f"column {name!r}", reason, remedy)
        unit = file_unit
    if unit and unit not in units:
        reason = f"its name ends in _{unit}, which is not a unit of a {role.dimension}"
        raise ReconcileError(table.source, f"column {name!r}", reason, remedy)
    factor, offset = units[unit] if unit else (1.0, 0.0)
    if (factor, offset) == (1.0, 0.0):
        return SiValues(column.values)
    return SiValues(column.values * factor + offset, factor)


def _time(table: Table, mapping: Mapping, time_s: Array | None, axes: dict[str, dict[str, Array]]) -> Array:
    if mapping.period_s is not None:
        lengths = {len(values) for channels in axes.values() for values in channels.values()}
        return np.arange(max(lengths, default=0), dtype=np.float64) * mapping.period_s
    if time_s is None:
        have = short_list([*table.columns, *table.text_columns])
        remedy = "name it (--map time=NAME) or say the sample time (--map period=0.001)"
        raise ReconcileError(table.source, "", f"has no time; it has: {have}", remedy)
    return time_s


def _check_angles(
    table: Table, mapping: Mapping, origin: dict[str, dict[str, str]], model: ByName[str, NominalAxis]
) -> None:
    """Raise ReconcileError for an angle or a torque of a linear axis that no factor converts."""
    converted = {entry.column for entry in mapping.entries if entry.factor is not None}
    for axis, columns in origin.items():
        if axis not in model or model[axis].rotary:
            continue
        for role, column in columns.items():
            _, unit, _ = unit_of_name(column)
            rotary = unit in ANGULAR or (ROLES[role].dimension == "force" and unit in TORQUES)
            if rotary and column not in converted:
                remedy = (
                    f'say [axis.{axis}] motion = "rotary" in the model file, or --map {role}={column}*FACTOR'
                )
                raise ReconcileError(table.source, f"column {column!r}", "is that of a rotary axis", remedy)


def _check_lengths(
    table: Table, time_s: Array, axes: dict[str, dict[str, Array]], origin: dict[str, dict[str, str]]
) -> None:
    for axis, channels in axes.items():
        for role, values in channels.items():
            if len(values) != len(time_s):
                name = origin[axis].get(role, role)
                reason = f"has {len(values)} values, the time has {len(time_s)}"
                raise ReconcileError(table.source, f"column {name!r}", reason)


def _force_per_volt(table: Table, mapping: Mapping) -> float | None:
    text = mapping.force_per_volt
    if not text:
        return None
    if text in table.columns:
        value = float(table.columns[text].values[0])
    else:
        try:
            value = float(text)
        except ValueError:
            reason = f"{text!r} is neither a number nor a constant of the file"
            raise ReconcileError(table.source, "--map force_per_volt", reason) from None
    if not np.isfinite(value) or value == 0.0:
        raise ReconcileError(table.source, "--map force_per_volt", f"{value} N/V cannot be")
    return value


def _add_force(channels: dict[str, Array], model: NominalAxis, force_per_volt: float | None) -> None:
    """Set `force` from the first of force, current and voltage that has values."""
    for role in ("force", "current", "voltage"):
        values = channels.get(role)
        if values is None or not np.isfinite(values).any():
            continue
        if role == "voltage" and force_per_volt is None:
            continue
        gain = {"force": 1.0, "current": model.force_constant_n_a, "voltage": force_per_volt or 0.0}[role]
        channels["force"] = values * gain
        return
    channels.pop("force", None)


def missing(channels: dict[str, Array], axis: str, table: Table) -> ReconcileError:
    """Return the error for an axis without one of the required channels."""
    where = f"axis {axis}"
    if "position" not in channels:
        reason = f"has no motor position ({REQUIRED} are required); the file has: {short_list(table.columns)}"
        return ReconcileError(table.source, where, reason, f"name it: --map {axis}.position=NAME")
    if "voltage" in channels:
        remedy = "say how much force a volt makes: --map force_per_volt=NUMBER"
        return ReconcileError(table.source, where, "has a voltage, but no force or current", remedy)
    reason = (
        f"has no motor force, current or voltage with any value; the file has: {short_list(table.columns)}"
    )
    return ReconcileError(table.source, where, reason, f"name it: --map {axis}.force=NAME")
