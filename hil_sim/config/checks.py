"""What one key alone cannot say: effects that need one another, stiffness that the substep resolves."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from hil_sim.physics.motor import transport_delay

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hil_sim.config.model import AxisPlant

NEEDS = {
    "backlash": "drive_compliance",
    "stribeck_friction": "coulomb_friction",
    "presliding_lugre": "coulomb_friction",
    "presliding_gms": "coulomb_friction",
    "temperature_dependent_friction": "coulomb_friction",
    "lubrication_loss": "coulomb_friction",
    "friction_ageing": "coulomb_friction",
    "asymmetric_coulomb_friction": "coulomb_friction",
    "position_dependent_friction": "coulomb_friction",
    "dwell_dependent_breakaway": "coulomb_friction",
    "asymmetric_viscous_friction": "viscous_friction",
}
ON_THE_SCALE = ("scale_cyclic_error", "cross_axis_coupling")
LISTS = {"presliding_gms": "share", "cogging": "amplitude_n", "torque_ripple": "amplitude"}
"""Lists that the kernels read up to their first zero."""
SHARE_TOLERANCE = 1e-6


def problems_of(axis: AxisPlant, dt_s: float) -> Iterator[tuple[str, str]]:
    """(section, reason) of everything in an axis that cannot be simulated with substeps of `dt_s` (s)."""
    effects = axis.effects
    yield from _missing_or_twice(axis)
    if "presliding_gms" in effects:
        total = math.fsum(effects["presliding_gms"].share)
        if abs(total - 1.0) > SHARE_TOLERANCE:
            yield "presliding_gms", f"the shares add up to {total:g}, not 1"
    for name, key in LISTS.items():
        values = getattr(effects[name], key) if name in effects else ()
        if any(before == 0.0 != after for before, after in pairwise(values)):
            yield name, f"{key} ends at its first zero, but other values follow"
    if "transport_delay" in effects and effects["transport_delay"].delay_s > transport_delay.LONGEST * dt_s:
        yield "transport_delay.delay_ms", f"more than {transport_delay.LONGEST} substeps"
    yield from _current_loop(axis, dt_s)
    yield from _too_stiff(axis, dt_s)


def _missing_or_twice(axis: AxisPlant) -> Iterator[tuple[str, str]]:
    """Sections that need another one, and two for one thing."""
    effects = axis.effects
    for name, needed in NEEDS.items():
        if name in effects and needed not in effects:
            yield name, f"needs the section {needed}"
    for name in ON_THE_SCALE:
        if name in effects and axis.scale is None:
            yield name, "needs the section scale"
    if "presliding_lugre" in effects and "presliding_gms" in effects:
        yield "presliding_gms", "only one of the two: remove presliding_lugre or presliding_gms"
    if "stribeck_friction" in effects and "coulomb_friction" in effects:
        at_rest_n = effects["coulomb_friction"].coulomb_n + effects["stribeck_friction"].stribeck_n
        if at_rest_n < 0.0:
            yield "stribeck_friction.stribeck_n", f"friction at rest would be {at_rest_n:g} N, below 0"
    if "voltage_saturation" in effects and "winding" in effects:
        yield "voltage_saturation", "winding has the amplifier's voltage_limit_v: remove one of the two"


def _current_loop(axis: AxisPlant, dt_s: float) -> Iterator[tuple[str, str]]:
    """One of the two current loops; a proportional one that does not ring from substep to substep."""
    gain_v_a = axis.amplifier.current_gain_v_a
    if (gain_v_a > 0.0) == (axis.amplifier.current_bandwidth_hz > 0.0):
        yield "amplifier", "give either current_bandwidth_hz or current_gain_v_a"
    if gain_v_a == 0.0:
        return
    if "winding" not in axis.effects:
        yield "amplifier.current_gain_v_a", "needs the section winding"
        return
    winding = axis.effects["winding"]
    kept = math.exp(-winding.resistance_v_a * dt_s / winding.inductance_h)
    if kept < gain_v_a / winding.resistance_v_a * (1.0 - kept):
        yield "amplifier.current_gain_v_a", "too high for the winding at this substep"


def _presliding_n_m(effects: dict[str, Any]) -> float:
    """Stiffness of the contact when all of it sticks."""
    stiffness_n_m = 0.0
    if "presliding_lugre" in effects:
        stiffness_n_m += effects["presliding_lugre"].stiffness_n_m
    if "presliding_gms" in effects:
        stiffness_n_m += math.fsum(effects["presliding_gms"].stiffness_n_m)
    if "presliding_hysteresis" in effects:
        stiffness_n_m += effects["presliding_hysteresis"].level_n / effects["presliding_hysteresis"].way_m
    return stiffness_n_m


def _steepest_n_m(effects: dict[str, Any]) -> float:
    """Largest slope of the position-dependent force, bounded from above."""
    if "position_dependent_force" not in effects:
        return 0.0
    force = effects["position_dependent_force"]
    steepest_n = abs(force.power_1_n) + 2.0 * abs(force.power_2_n) + 3.0 * abs(force.power_3_n)
    return float(steepest_n / force.half_travel_m)


def _too_stiff(axis: AxisPlant, dt_s: float) -> Iterator[tuple[str, str]]:
    """Semi-implicit Euler holds k dt^2 + 2 c dt < 4 m; a quarter keeps the error of the frequency small."""
    effects = axis.effects
    motor_kg = axis.motor_mass_kg
    table_kg = axis.table.mass_kg
    moved_kg = table_kg if "drive_compliance" in effects else table_kg + motor_kg
    if "structural_mode" in effects:
        mode = effects["structural_mode"]
        w_dt = 2.0 * math.pi * mode.frequency_hz * dt_s
        if (w_dt**2 + 4.0 * mode.damping_ratio * w_dt) * (1.0 + mode.mass_kg / moved_kg) > 1.0:
            yield "structural_mode", "too stiff for the table at this substep: lower frequency_hz or mass_kg"
    presliding_n_m = _presliding_n_m(effects)
    if presliding_n_m * dt_s**2 > moved_kg:
        yield (
            "table",
            f"mass_kg is too small for a presliding stiffness of {presliding_n_m:g} N/m at this substep",
        )
    if _steepest_n_m(effects) * dt_s**2 > moved_kg:
        yield "position_dependent_force", "too steep for the table at this substep"
    if "drive_compliance" not in effects:
        return
    if motor_kg == 0.0:
        yield "drive_compliance", "needs motor.inertia_kg_cm2 above zero"
        return
    reduced_kg = motor_kg * table_kg / (motor_kg + table_kg)
    screw = effects["drive_compliance"]
    if screw.stiffness_n_m * dt_s**2 + 2.0 * screw.damping_n_s_m * dt_s > reduced_kg:
        yield (
            "drive_compliance",
            "too stiff for the masses at this substep: choose a smaller plant.substep_us",
        )
