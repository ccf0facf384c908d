"""The file of the nominal model, a plant.toml that needs only the mechanics of each axis; and the update.

Required for each axis: transmission.lead_mm, motor.torque_constant_nm_a, table.mass_kg; optional are friction
and the resolutions of the sensors. The written file is complete, so that `hil-sim run` can run it.

A rotary axis is one in the coordinates of the computation: 1 m stands for 1 rad, 1 N for 1 N m and 1 kg for
1 kg m^2; the laws of the catalogue, and the plant that runs the written model, are the same.
"""

import copy
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from hil_sim.config.load import MOTIONS
from reconcile.errors import ReconcileError
from reconcile.formats.nominal_axis import BusNodes, DriveLoops, NominalAxis
from reconcile.formats.toml_file import document_of, toml_text
from reconcile.nominal_model.model_effects import model_effects_of
from servo_ctrl.config.file_format import FORMAT, format_problem
from shipped_files import EDS

KEYS = (
    ("table", "inertia_kg_m2", "mass_kg"),
    ("viscous_friction", "viscous_nm_s_rad", "viscous_n_s_m"),
    ("coulomb_friction", "coulomb_nm", "coulomb_n"),
)
"""Section, key of a rotary axis, key of a linear axis for the same number."""


def is_rotary(file: Path, name: str, table: Mapping[str, Any]) -> bool:
    """Return whether the axis is declared as rotary. Raises ReconcileError for an unknown motion."""
    motion = table.get("motion", MOTIONS[0])
    if motion not in MOTIONS:
        raise ReconcileError(file, f"axis.{name}.motion", f"{motion!r} is neither of {', '.join(MOTIONS)}")
    return bool(motion == "rotary")


def as_linear(file: Path, name: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a rotary axis with the keys of a linear one. Raises ReconcileError.

    Without a torque constant a recorded current counts as the torque at the joint.
    """
    axis: dict[str, Any] = {key: dict(of) if isinstance(of, dict) else of for key, of in table.items()}
    transmission = axis.setdefault("transmission", {})
    if "gear_ratio" in transmission:
        ratio = transmission.pop("gear_ratio")
        if isinstance(ratio, bool) or not isinstance(ratio, int | float) or not ratio > 0.0:
            raise ReconcileError(file, f"axis.{name}.transmission.gear_ratio", "must be a number above zero")
        transmission["lead_mm"] = 2000.0 * math.pi / ratio
    for section, key, same in KEYS:
        if key in axis.get(section, {}):
            axis[section][same] = axis[section].pop(key)
    lead_mm = transmission.get("lead_mm")
    motor = axis.setdefault("motor", {})
    if "torque_constant_nm_a" not in motor and isinstance(lead_mm, int | float):
        motor["torque_constant_nm_a"] = lead_mm / (2000.0 * math.pi)
    return axis


SECTIONS: dict[str, dict[str, Any]] = {
    "motor": {"rated_torque_mnm": 1000, "rated_current_ma": 1000, "inertia_kg_cm2": 0.0},
    "amplifier": {
        "current_bandwidth_hz": 1000.0,
        "voltage_limit_v": 325.0,
        "peak_current_a": 100.0,
        "position_gain_1_s": 20.0,
        "velocity_gain_n_s_m": 1000.0,
        "velocity_integral_n_m": 0.0,
        "velocity_feedforward": 1.0,
        "velocity_filter_hz": 1000.0,
    },
    "encoder": {"counts_per_rev": 1_048_576},
    "limit_switches": {"negative_mm": -1000.0, "positive_mm": 1000.0},
}
"""Values that a plant needs beside the physics, where the nominal model has none."""


class NominalModel(NamedTuple):
    """A model file."""

    file: Path
    document: dict[str, Any]
    axes: dict[str, NominalAxis]


def load_model(path: Path) -> NominalModel:
    """Read a model file, or the plant.toml of a directory. Raises ReconcileError."""
    file = path / "plant.toml" if path.is_dir() else path
    document = document_of(file)
    if problem := format_problem(document.get("format")):
        raise ReconcileError(file, "format", problem)
    if "machine" in document or "bus" in document:
        raise ReconcileError(
            file, "", "this is a controller file, --model wants the plant file of the same machine"
        )
    tables = document.get("axis")
    if not isinstance(tables, dict) or not tables:
        raise ReconcileError(file, "axis", "no axis", "describe at least one as [axis.x.table] mass_kg = ...")
    for name, table in tables.items():
        if isinstance(table, dict) and is_rotary(file, name, table):
            tables[name] = as_linear(file, name, table)
    return NominalModel(file, document, {name: _axis(file, name, tables) for name in tables})


def _axis(file: Path, name: str, tables: Mapping[str, Any]) -> NominalAxis:
    table = tables[name]

    def number(section: str, key: str, default: float | None = None) -> float:
        given = table.get(section, {}) if isinstance(table, dict) else {}
        value = given.get(key, default) if isinstance(given, dict) else None
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ReconcileError(file, f"axis.{name}.{section}.{key}", "a number is needed here")
        return float(value)

    lead_m = number("transmission", "lead_mm") * 1e-3
    if lead_m <= 0.0:
        raise ReconcileError(file, f"axis.{name}.transmission.lead_mm", "must be positive")
    turn_1_m = 2.0 * math.pi / lead_m
    motor_mass_kg = number("motor", "inertia_kg_cm2", 0.0) * 1e-4 * turn_1_m**2
    counts = number("encoder", "counts_per_rev", 0.0)
    scale_um = number("scale", "resolution_um", 0.0)
    return NominalAxis(
        lead_m=lead_m,
        force_constant_n_a=number("motor", "torque_constant_nm_a") * turn_1_m,
        mass_kg=number("table", "mass_kg") + motor_mass_kg,
        motor_mass_kg=motor_mass_kg,
        viscous_n_s_m=number("viscous_friction", "viscous_n_s_m", 0.0),
        coulomb_n=number("coulomb_friction", "coulomb_n", 0.0),
        encoder_resolution_m=lead_m / counts if counts else None,
        scale_resolution_m=scale_um * 1e-6 if scale_um else None,
        pole_pairs=round(number("motor", "pole_pairs", 0.0)) or None,
        grating_m=number("scale", "grating_um", 0.0) * 1e-6 or None,
        bus=_nodes(file, table),
        model_effects=model_effects_of(file, name, tables),
        drive_loops=_drive_loops(table),
        rotary=is_rotary(file, name, table),
    )


def _drive_loops(table: Mapping[str, Any]) -> DriveLoops:
    """Return the loops of the drive; none where the gains are those that a written file has for unknown ones.

    Only with a winding has the current loop a lag in hil_sim.
    """
    amplifier = table.get("amplifier", {})
    if not isinstance(amplifier, dict) or amplifier == SECTIONS["amplifier"]:
        return DriveLoops()
    keys = ("velocity_gain_n_s_m", "velocity_feedforward", "current_bandwidth_hz")
    given = (amplifier.get(key) for key in keys)
    gain_n_s_m, feedforward, bandwidth_hz = (
        float(value) if isinstance(value, int | float) else 0.0 for value in given
    )
    has_lag = "winding" in table and bandwidth_hz > 0.0
    return DriveLoops(
        feedforward_n_s_m=gain_n_s_m * feedforward,
        current_lag_s=1.0 / (2.0 * math.pi * bandwidth_hz) if has_lag else 0.0,
    )


def _nodes(file: Path, table: Mapping[str, Any]) -> BusNodes | None:
    """Return the bus nodes of the axis; None where the model does not describe them completely."""
    try:
        drive, scale = table["drive"], table.get("scale", {})
        has_scale = "node_id" in scale
        return BusNodes(
            drive_node_id=int(drive["node_id"]),
            drive_eds=(file.parent / drive["eds"]).resolve(),
            rated_torque_nm=float(table["motor"]["rated_torque_mnm"]) * 1e-3,
            rated_current_a=float(table["motor"]["rated_current_ma"]) * 1e-3,
            scale_node_id=int(scale["node_id"]) if has_scale else None,
            scale_eds=(file.parent / scale["eds"]).resolve() if has_scale else None,
        )
    except (KeyError, TypeError, ValueError):
        return None


def write_model(
    model: NominalModel, updates: Mapping[str, Mapping[str, Mapping[str, Any]]], path: Path
) -> None:
    """Write a complete plant file: the model with `updates`, values by axis, section and key of the TOML."""
    document = copy.deepcopy(model.document)
    plant = document.setdefault("plant", {})
    plant.setdefault("name", model.file.parent.name or "repaired")
    for number, (name, axis) in enumerate(document["axis"].items(), start=1):
        axis.pop("controller", None)  # plant files have none, nor the keys that only name orders
        axis.get("motor", {}).pop("pole_pairs", None)
        axis.get("scale", {}).pop("grating_um", None)
        for section, values in SECTIONS.items():
            axis[section] = {**values, **axis.get(section, {})}
        axis.setdefault("drive", {"node_id": number, "eds": str(EDS / "servo_drive.eds")})
        if "resolution_um" in axis.get("scale", {}):
            axis["scale"] = {"node_id": 10 + number, "eds": str(EDS / "linear_scale.eds"), **axis["scale"]}
        for section in ("drive", "scale"):
            if "eds" in axis.get(section, {}):
                eds = (model.file.parent / axis[section]["eds"]).resolve()
                axis[section]["eds"] = os.path.relpath(eds, path.resolve().parent)
        for section, updated in updates.get(name, {}).items():
            axis[section] = {**axis.get(section, {}), **updated}
    text = "# Written by reconcile; the effects that it has added stand in their own tables.\n"
    text += toml_text({"format": FORMAT, **document})
    path.write_text(text, encoding="utf-8")
