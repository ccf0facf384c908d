"""Checks across sections of a plant file: required and exclusive sections, stiffness against the substep."""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise

from hil_sim.config.model import AxisPlant
from hil_sim.physics.kinds import AxisContext, Kind
from hil_sim.physics.registry import EFFECTS, of_kind
from kernels.quantities import section_of

SCALE_EFFECTS = of_kind(Kind.SCALE_READING, Kind.CROSS_READING)
BY_SECTION = {section_of(effect): effect for effect in EFFECTS}
CONTACTS = of_kind(Kind.PRESLIDING)


def problems_of(axis: AxisPlant, dt_s: float) -> Iterator[tuple[str, str]]:
    """Yield every (section, reason) for which an axis cannot be simulated with substeps of `dt_s` (s)."""
    effects = axis.effects
    context = AxisContext(effects=effects, moved_kg=_felt_mass_kg(axis), dt_s=dt_s)
    yield from _missing_or_exclusive(axis)
    for name, effect in BY_SECTION.items():
        if name not in effects:
            continue
        for key, reason in effect.problems(effects[name], context) if hasattr(effect, "problems") else ():
            yield f"{name}.{key}" if key else name, reason
        key = getattr(effect, "LIST_ENDS_AT", "")  # the kernels read lists up to their first zero
        values = getattr(effects[name], key) if key else ()
        if any(before == 0.0 != after for before, after in pairwise(values)):
            yield name, f"{key} ends at its first zero, but other values follow"
    yield from _current_loop(axis, dt_s)
    yield from _too_stiff(axis, context)


def problems_between(axes: Mapping[str, AxisPlant]) -> Iterator[tuple[str, str, str]]:
    """Yield (axis, section, reason) for couplings of two axes that no two bodies have."""
    names = list(axes)
    for name, axis in axes.items():
        if "joint_coupling" not in axis.effects:
            continue
        coupling = axis.effects["joint_coupling"]
        other = axes[names[int(coupling.other)]]
        inner, outer = (other, axis) if coupling.outer > 0.0 else (axis, other)
        for cosine in (-1.0, 1.0):
            coupled_kg = coupling.inertia_kg + cosine * coupling.arm_kg
            inner_kg = _felt_mass_kg(inner) + 2.0 * cosine * coupling.arm_kg
            if not (inner_kg > 0.0 and coupled_kg**2 < inner_kg * _felt_mass_kg(outer)):
                yield (
                    name,
                    "joint_coupling",
                    "too large for the masses: their kinetic energy would be negative",
                )


def _felt_mass_kg(axis: AxisPlant) -> float:
    """Mass that a force on the table accelerates, kg."""
    return axis.table.mass_kg + (0.0 if "drive_compliance" in axis.effects else axis.motor_mass_kg)


def _missing_or_exclusive(axis: AxisPlant) -> Iterator[tuple[str, str]]:
    """Yield sections that need another one, and sections that exclude each other."""
    effects = axis.effects
    for name, effect in BY_SECTION.items():
        needed = getattr(effect, "NEEDS", name)
        if name in effects and needed not in effects:
            yield name, f"needs the section {needed}"
    for effect in SCALE_EFFECTS:
        if section_of(effect) in effects and axis.scale is None:
            yield section_of(effect), "needs the section scale"
    contacts = [section_of(effect) for effect in CONTACTS if section_of(effect) in effects]
    if len(contacts) > 1:
        yield contacts[0], f"only one of the two: remove {' or '.join(reversed(contacts))}"


def _current_loop(axis: AxisPlant, dt_s: float) -> Iterator[tuple[str, str]]:
    """Require exactly one current loop, and a proportional gain that is stable at the substep."""
    gain_v_a = axis.amplifier.current_gain_v_a
    if (gain_v_a > 0.0) == (axis.amplifier.current_bandwidth_hz > 0.0):
        yield "amplifier", "give either current_bandwidth_hz or current_gain_v_a"
    if gain_v_a == 0.0:
        return
    if "winding" not in axis.effects:
        yield "amplifier.current_gain_v_a", "needs the section winding"
        return
    winding = axis.effects["winding"]
    decay = math.exp(-winding.resistance_v_a * dt_s / winding.inductance_h)
    if decay < gain_v_a / winding.resistance_v_a * (1.0 - decay):  # the pole of the loop would be negative
        yield "amplifier.current_gain_v_a", "too high for the winding at this substep"


def _too_stiff(axis: AxisPlant, context: AxisContext) -> Iterator[tuple[str, str]]:
    """Require k dt^2 + 2 c dt < m.

    Semi-implicit Euler is stable up to 4 m; a quarter keeps the frequency error small.
    """
    effects, dt_s = axis.effects, context.dt_s
    motor_kg, table_kg = axis.motor_mass_kg, axis.table.mass_kg
    presliding_n_m = math.fsum(
        BY_SECTION[name].sticking_stiffness_n_m(effects[name])
        for name in effects
        if BY_SECTION[name].KIND in {Kind.PRESLIDING, Kind.PRESLIDING_LEVEL}
    )
    if presliding_n_m * dt_s**2 > context.moved_kg:
        yield (
            "table",
            f"mass_kg is too small for a presliding stiffness of {presliding_n_m:g} N/m at this substep",
        )
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
