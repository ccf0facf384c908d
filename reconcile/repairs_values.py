"""From the parameters of a finding to those of the plant's effect, SI on both sides."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import minimize_scalar

from hil_sim.physics.motor import cogging, torque_ripple
from hil_sim.physics.quantities import effect_name, fields_of
from hil_sim.physics.registry import EFFECTS
from reconcile.repairs_found import NotInAPlant
from reconcile.repairs_warmth import expansion, lubricant

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from reconcile.repairs_found import Found, Term

    Values = dict[str, Any]

PARAMETERS = {effect_name(module): {f.name for f in fields_of(module.Params)} for module in EFFECTS}
RENAMED = {
    "lead_error_periodic": {"amplitude": "amplitude_m"},
    "encoder_eccentricity": {"amplitude": "amplitude_m"},
    "scale_cyclic_error": {"amplitude": "amplitude_m"},
    "periodic_disturbance": {"amplitude": "amplitude_n"},
    "transport_delay": {"time_s": "delay_s"},
}
"""Parameters that have another name in the plant."""
PITCH = {
    "cogging": "harmonic",
    "torque_ripple": "harmonic",
    "lead_error_periodic": "harmonic",
    "encoder_eccentricity": "",
    "scale_cyclic_error": "period_m",
    "periodic_disturbance": "frequency_hz",
}
"""Effects that are waves, and what tells one wave from another."""
LISTS = {"cogging": cogging.TERMS, "torque_ripple": torque_ripple.TERMS}
"""How many waves the plant takes, where it is more than one."""
WAYS_M = np.geomspace(1e-7, 1e-3, 60)


def values_of(found: Found) -> tuple[Values, list[str]]:
    """Parameters of the plant's effect by their names in hil_sim, and what there is to say about them.

    Raises:
        NotInAPlant: there is no such effect.

    """
    effect, notes = found.finding.effect, []
    if effect not in PARAMETERS:
        raise NotInAPlant("it is in no catalogue, so no plant has it")
    if len(found.scenes) > 1 and any(candidate.per_recording for candidate in found.finding.candidates):
        notes.append(f"{effect} has its phase as in the first recording, {found.sources[0]}")
    if effect in PITCH:
        values = _waves(effect, found.terms, notes)
    else:
        values = CONVERSIONS.get(effect, _as_it_is)(found, notes)
    names = RENAMED.get(effect, {})
    renamed = {names.get(key, key): value for key, value in values.items()}
    return {key: value for key, value in renamed.items() if key in PARAMETERS[effect]}, notes


def _as_it_is(found: Found, _notes: list[str]) -> Values:
    return dict(found.terms[0])


def _waves(effect: str, terms: Sequence[Term], notes: list[str]) -> Values:
    """Waves of one pitch are one; the strongest ones are kept, as many as the plant takes."""
    sums: dict[float, complex] = {}
    for term in terms:
        pitch = term.get(PITCH[effect], 1.0)
        sums[pitch] = sums.get(pitch, 0.0) + cmath.rect(term["amplitude"], term["phase_rad"])
    strongest = sorted(sums, key=lambda pitch: abs(sums[pitch]), reverse=True)
    kept, left = strongest[: LISTS.get(effect, 1)], strongest[LISTS.get(effect, 1) :]
    notes += [
        f"{effect}: {PITCH[effect]} {pitch:g} (amplitude {abs(sums[pitch]):.3g}) is left out, the plant "
        f"takes {LISTS.get(effect, 1)}"
        for pitch in left
    ]
    values = {
        PITCH[effect]: kept,
        "amplitude_n" if effect == "cogging" else "amplitude": [abs(sums[pitch]) for pitch in kept],
        "phase_rad": [cmath.phase(sums[pitch]) for pitch in kept],
    }
    return values if effect in LISTS else {key: value[0] for key, value in values.items()}


def _presliding(found: Found, notes: list[str]) -> Values:
    """One level and way; several are brought together where their curves are nearest."""
    levels_n = np.array([term["level_n"] for term in found.terms])
    ways_m = np.array([term["way_m"] for term in found.terms])
    if len(ways_m) == 1:
        return dict(found.terms[0])
    total_n = float(levels_n.sum())
    wanted_n = -np.expm1(-WAYS_M[:, None] / ways_m) @ levels_n

    def off(logarithm: float) -> float:
        one_n = -total_n * np.expm1(-WAYS_M / math.exp(logarithm))
        return float(np.sum((one_n - wanted_n) ** 2))

    bounds = math.log(0.5 * ways_m.min()), math.log(2.0 * ways_m.max())
    way_m = math.exp(minimize_scalar(off, bounds=bounds, method="bounded").x)
    notes.append(
        f"presliding_hysteresis: {len(ways_m)} ways were found, the plant takes one; {way_m * 1e6:.3g} um "
        "comes nearest"
    )
    return {"level_n": total_n, "way_m": way_m}


def _dead_zone(found: Found, _notes: list[str]) -> Values:
    return {"threshold_a": found.terms[0]["threshold_n"] / found.axis.force_constant_n_a}


def _saturation(found: Found, _notes: list[str]) -> Values:
    """Kf i / sqrt(1 + (i / Is)^2) = F for the current i = (1 + loss) F / Kf at the strongest F."""
    loss, peak_n = found.terms[0]["loss_at_peak"], found.terms[0]["peak_n"]
    if loss <= 0.0:
        raise NotInAPlant("it was found that more force comes of a high current, and not less")
    return {"saturation_a": peak_n / found.axis.force_constant_n_a / math.sqrt(1.0 - (1.0 + loss) ** -2)}


def _voltage(found: Found, _notes: list[str]) -> Values:
    """Stall force Kf Umax / R and speed without load Umax / Kf; Kf is the back-EMF constant too."""
    term, constant_n_a = found.terms[0], found.axis.force_constant_n_a
    limit_v = term["free_m_s"] * constant_n_a
    return {"voltage_limit_v": limit_v, "resistance_v_a": constant_n_a * limit_v / term["stall_n"]}


def _compliance(found: Found, _notes: list[str]) -> Values:
    return {"stiffness_n_m": found.terms[0]["stiffness_n_m"]}


def _coupling(found: Found, notes: list[str]) -> Values:
    """The axis that moves the reading most; the plant follows one."""
    if found.finding.sense != "deviation":
        raise NotInAPlant("no force goes from axis to axis in a plant")
    others = found.scenes[0].others
    slopes = {name: found.terms[0][f"coefficient_{k}"] for k, name in enumerate(others, start=1)}
    swing_m = {name: abs(slopes[name]) * float(np.ptp(others[name].position_m)) for name in others}
    strongest = max(swing_m, key=lambda name: swing_m[name])
    notes += [
        f"cross_axis_coupling: axis {name} ({slopes[name] * 1e6:.3g} um/m) is left out, the plant takes one"
        for name in others
        if name != strongest
    ]
    return {"other": strongest, "squareness": slopes[strongest]}


CONVERSIONS: dict[str, Callable[[Found, list[str]], Values]] = {
    "presliding_hysteresis": _presliding,
    "amplifier_dead_zone": _dead_zone,
    "torque_constant_saturation": _saturation,
    "voltage_saturation": _voltage,
    "drive_compliance": _compliance,
    "cross_axis_coupling": _coupling,
    "temperature_dependent_friction": lubricant,
    "thermal_expansion": expansion,
}
"""Of the other effects the parameters are the plant's own."""
