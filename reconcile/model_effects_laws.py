"""From each effect of the plant to the entries of the catalogue that it is, with their coefficients.

Forces of the catalogue are those that the motor needs, so a force on the table comes with a minus.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from reconcile.catalogue.kinds import Sense
from reconcile.catalogue.registry import ENTRIES
from reconcile.model_effects_known import Known
from reconcile.model_effects_warmth import expansion, lubricant
from reconcile.repairs import CONTACT_DAMPING_RATIO

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from reconcile.catalogue.kinds import Scene, Shape
    from reconcile.model_effects_known import Asked

FORCE, DEVIATION = Sense.FORCE, Sense.DEVIATION
DEEPEST = 0.9
"""Share of the saturated force up to which the saturation's law is put into a loss at a peak."""


def _dead_zone(asked: Asked) -> list[Known]:
    """As sharp as the entry is scanned: that of the plant steps, and its width is none of its parameters."""
    lost_n = asked.params.threshold_a * asked.axis.force_constant_n_a
    scanned = _scanned("amplifier_dead_zone", asked.scenes)
    return [Known("amplifier_dead_zone", min(scanned, default=(lost_n,)), (lost_n,), FORCE)]


def _asymmetric_coulomb(asked: Asked) -> list[Known]:
    """While the axis moves it is a constant force."""
    return [Known("constant_force", (), (asked.params.half_difference_n,), FORCE)]


def _asymmetric_viscous(asked: Asked) -> list[Known]:
    return [Known("asymmetric_viscous_friction", (), (asked.params.half_difference_n_s_m,), FORCE)]


def _backlash(asked: Asked) -> list[Known]:
    """The table flies under all of the friction, as in the plant."""
    play_m, base = asked.params.play_m, asked.base
    table_kg = base["mass_kg"] - asked.axis.motor_mass_kg
    brakes = base["coulomb_n"] / table_kg, base["viscous_n_s_m"] / table_kg
    return [Known("backlash", (play_m, *brakes), (play_m,), DEVIATION)] if play_m > 0.0 else []


def _cogging(asked: Asked) -> list[Known]:
    p = asked.params
    return _harmonics("cogging", p.harmonic, p.amplitude_n, p.phase_rad)


def _torque_ripple(asked: Asked) -> list[Known]:
    p = asked.params
    return _harmonics("torque_ripple", p.harmonic, p.amplitude, p.phase_rad)


def _harmonics(
    effect: str, harmonics: Sequence[float], amplitudes: Sequence[float], phases_rad: Sequence[float]
) -> list[Known]:
    """Up to the first amplitude of zero, where the plant's list ends."""
    found = []
    for harmonic, amplitude, phase_rad in zip(harmonics, amplitudes, phases_rad, strict=True):
        if amplitude == 0.0:
            break
        found.append(Known(effect, (harmonic,), _pair(-amplitude, phase_rad), FORCE))
    return found


def _pair(amplitude: float, phase_rad: float) -> tuple[float, float]:
    """Of sine and cosine."""
    return amplitude * math.cos(phase_rad), amplitude * math.sin(phase_rad)


def _constant_force(asked: Asked) -> list[Known]:
    return [Known("constant_force", (), (-asked.params.force_n,), FORCE)]


def _coupling(asked: Asked) -> list[Known]:
    """Nothing where the other axis was not recorded."""
    others = list(asked.scenes[0].others)
    slopes = tuple(asked.params.squareness if name == asked.other else 0.0 for name in others)
    return [Known("cross_axis_coupling", (), slopes, DEVIATION)]


def _lag(asked: Asked) -> list[Known]:
    """The plant has one pole."""
    time_s = asked.params.time_s
    return [Known("current_loop_lag", (time_s, 1.0), (1.0,), FORCE)] if time_s > 0.0 else []


def _compliance(asked: Asked) -> list[Known]:
    """Not that of the contact that the repairs give to a play: it is stiffer than could be seen."""
    if "backlash" in asked.effects and math.isclose(_damping_ratio(asked), CONTACT_DAMPING_RATIO):
        return []
    # where the rotor's mass is not known its acceleration has a column of its own
    rotor = () if asked.scenes[0].motor_mass_kg > 0.0 else (0.0,)
    return [Known("drive_compliance", (), (1.0 / asked.params.stiffness_n_m, *rotor), DEVIATION)]


def _damping_ratio(asked: Asked) -> float:
    p, motor_kg = asked.params, asked.axis.motor_mass_kg
    reduced_kg = motor_kg * (1.0 - motor_kg / asked.base["mass_kg"])
    return float(p.damping_n_s_m / (2.0 * math.sqrt(p.stiffness_n_m * reduced_kg))) if reduced_kg > 0 else 0.0


def _dwell(asked: Asked) -> list[Known]:
    p = asked.params
    return [Known("dwell_dependent_breakaway", (p.way_m, p.time_s), (p.growth_n,), FORCE)]


def _eccentricity(asked: Asked) -> list[Known]:
    """What the encoder reads ahead the scale lags; a third sensor would tell it from a lead error."""
    p = asked.params
    return [Known("lead_error_periodic", (1.0,), _pair(-p.amplitude_m, p.phase_rad), DEVIATION)]


def _lead_cumulative(asked: Asked) -> list[Known]:
    return [Known("lead_error_cumulative", (), (asked.params.relative_error,), DEVIATION)]


def _lead_periodic(asked: Asked) -> list[Known]:
    p = asked.params
    return [Known("lead_error_periodic", (p.harmonic,), _pair(p.amplitude_m, p.phase_rad), DEVIATION)]


def _disturbance(asked: Asked) -> list[Known]:
    """As if the recording began at power-up, which is how the repairs write it."""
    p = asked.params
    return [Known("periodic_disturbance", (p.frequency_hz,), _pair(-p.amplitude_n, p.phase_rad), FORCE)]


def _force_over_travel(asked: Asked) -> list[Known]:
    shape, powers = _cubic(asked)
    return [Known("position_dependent_force", shape, tuple(-c for c in powers), FORCE)] if powers else []


def _friction_over_travel(asked: Asked) -> list[Known]:
    shape, powers = _cubic(asked)
    return [Known("position_dependent_friction", shape, powers, FORCE)] if powers else []


def _cubic(asked: Asked) -> tuple[Shape, tuple[float, ...]]:
    """Up to the highest power; beyond the model's travel the plant holds it, the entry does not."""
    p = asked.params
    powers = [p.power_1_n, p.power_2_n, p.power_3_n]
    while powers and powers[-1] == 0.0:
        powers.pop()
    return (float(len(powers)), p.centre_m, p.half_travel_m), tuple(powers)


def _dahl(asked: Asked) -> list[Known]:
    return [Known("presliding_hysteresis", (asked.params.way_m, 1.0), (asked.params.level_n,), FORCE)]


def _lugre(asked: Asked) -> list[Known]:
    """At a constant level the bristle is Dahl's, of all the sharp friction; its damping is left out."""
    level_n = asked.axis.coulomb_n
    way_m = level_n / asked.params.stiffness_n_m
    return [Known("presliding_hysteresis", (way_m, 1.0), (level_n,), FORCE)] if level_n > 0.0 else []


def _gms(asked: Asked) -> list[Known]:
    """An element slips 2 F / k after a reversal; the exponential of the same area has the way F / k."""
    p = asked.params
    found = []
    for share, stiffness_n_m in zip(p.share, p.stiffness_n_m, strict=True):
        force_n = share * asked.axis.coulomb_n
        if share == 0.0:
            break
        if force_n * stiffness_n_m > 0.0:
            found.append(Known("presliding_hysteresis", (force_n / stiffness_n_m, 1.0), (force_n,), FORCE))
    return found


def _quadratic(asked: Asked) -> list[Known]:
    return [Known("quadratic_viscous_friction", (), (asked.params.quadratic_n_s2_m2,), FORCE)]


def _cyclic(asked: Asked) -> list[Known]:
    p = asked.params
    return [Known("scale_cyclic_error", (p.period_m,), _pair(p.amplitude_m, p.phase_rad), DEVIATION)]


def _stribeck(asked: Asked) -> list[Known]:
    p = asked.params
    return [Known("stribeck_friction", (p.stribeck_m_s,), (p.stribeck_n,), FORCE)]


def _saturation(asked: Asked) -> list[Known]:
    """By which share more than F is asked for, F = A / sqrt(1 + (A / Fs)^2), at the strongest force."""
    saturated_n = asked.params.saturation_a * asked.axis.force_constant_n_a
    found = []
    for (strongest_n,) in _scanned("torque_constant_saturation", asked.scenes)[:1]:
        peak_n = min(strongest_n, DEEPEST * saturated_n)
        loss = 1.0 / math.sqrt(1.0 - (peak_n / saturated_n) ** 2) - 1.0
        found.append(Known("torque_constant_saturation", (peak_n,), (loss,), FORCE))
    return found


def _delay(asked: Asked) -> list[Known]:
    delay_s = asked.params.delay_s
    return [Known("transport_delay", (delay_s,), (1.0,), FORCE)] if delay_s > 0.0 else []


def _voltage(asked: Asked) -> list[Known]:
    """All of the excess is missing."""
    p, constant_n_a = asked.params, asked.axis.force_constant_n_a
    stall_n, free_m_s = constant_n_a * p.voltage_limit_v / p.resistance_v_a, p.voltage_limit_v / constant_n_a
    return [Known("voltage_saturation", (stall_n, free_m_s), (1.0,), FORCE)]


def _scanned(effect: str, scenes: Sequence[Scene]) -> list[Shape]:
    return list(ENTRIES[effect].HYPOTHESES[0].shapes(scenes))


LAWS: dict[str, Callable[[Asked], list[Known]]] = {
    "amplifier_dead_zone": _dead_zone,
    "asymmetric_coulomb_friction": _asymmetric_coulomb,
    "asymmetric_viscous_friction": _asymmetric_viscous,
    "backlash": _backlash,
    "cogging": _cogging,
    "constant_force": _constant_force,
    "cross_axis_coupling": _coupling,
    "current_loop_lag": _lag,
    "drive_compliance": _compliance,
    "dwell_dependent_breakaway": _dwell,
    "encoder_eccentricity": _eccentricity,
    "lead_error_cumulative": _lead_cumulative,
    "lead_error_periodic": _lead_periodic,
    "periodic_disturbance": _disturbance,
    "position_dependent_force": _force_over_travel,
    "position_dependent_friction": _friction_over_travel,
    "presliding_gms": _gms,
    "presliding_hysteresis": _dahl,
    "presliding_lugre": _lugre,
    "quadratic_viscous_friction": _quadratic,
    "scale_cyclic_error": _cyclic,
    "stribeck_friction": _stribeck,
    "temperature_dependent_friction": lubricant,
    "thermal_expansion": expansion,
    "torque_constant_saturation": _saturation,
    "torque_ripple": _torque_ripple,
    "transport_delay": _delay,
    "voltage_saturation": _voltage,
}
"""By the plant's effect."""
