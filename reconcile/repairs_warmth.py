"""Drifts found over time or temperature, as heat balances of the plant: C dT/dt = P - T / R."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.repairs_found import NotInAPlant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.repairs_found import Found

    Array = NDArray[np.float64]
    Values = dict[str, Any]

WARM_K = 10.0
"""Of the lubricant at most: only its ratio to `warmth_scale_k` counts."""
LEAST_J_K, MOST_K_W = 1.0, 1e3
"""What the plant takes."""
STEEL_1_K = 12e-6
"""Expansion of the screw, where no temperature was recorded: only its product with the warming counts."""
ROOM_K = 293.15
LEAST_BEND, MOST_LEFT, HIGHEST_SHARE = 0.1, 0.95, 19.0
"""Change over the scale of the warmth: as small as the change that was found allows, so that it is linear."""


class Warming(NamedTuple):
    """What heats an axis in a recording."""

    friction_w: Array
    """(n,)"""
    period_s: float
    time_s: float | None
    """Time constant that was found; None where the temperature was recorded."""
    temperature_k: Array | None


class Balance(NamedTuple):
    """A lumped heat balance and how warm it gets above its start."""

    rise_k: float
    heat_capacity_j_k: float
    resistance_k_w: float


def lubricant(found: Found, notes: list[str]) -> Values:
    """Parameters of temperature_dependent_friction: changes as shares of the cold friction."""
    term, warming = found.terms[0], _warming(found)
    balance = _balance(warming, WARM_K)
    per_kelvin = balance.rise_k if warming.time_s is None else 1.0
    scale = min(
        WARM_K / balance.rise_k, balance.heat_capacity_j_k / LEAST_J_K, MOST_K_W / balance.resistance_k_w
    )
    balance = Balance(
        balance.rise_k * scale, balance.heat_capacity_j_k / scale, balance.resistance_k_w * scale
    )
    share = {}
    for key in ("level_n", "viscous_n_s_m"):
        cold = found.base["coulomb_n" if key == "level_n" else key]
        change = term[key] * per_kelvin
        share[key] = change / cold if cold > 0.0 else 0.0
        if share[key] < -MOST_LEFT:
            notes.append(
                f"temperature_dependent_friction.{key} was found to be {term[key]:.4g}, of {cold:.4g}; it is "
                f"written as {100.0 * MOST_LEFT:.0f} % of that"
            )
            share[key] = -MOST_LEFT
    if not any(share.values()):
        raise NotInAPlant("there is no friction that could change")
    bend = max(LEAST_BEND, -min(share.values()), max(share.values()) / HIGHEST_SHARE)
    return {
        "warm_level_share": 1.0 + share["level_n"] / bend,
        "warm_damping_share": 1.0 + share["viscous_n_s_m"] / bend,
        "warmth_scale_k": -balance.rise_k / math.log1p(-bend),
        "heat_capacity_j_k": balance.heat_capacity_j_k,
        "resistance_k_w": balance.resistance_k_w,
    }


def expansion(found: Found, notes: list[str]) -> Values:
    """Parameters of thermal_expansion: a growth over the run, or per kelvin."""
    term, warming = found.terms[0], _warming(found)
    growth, recorded = term["growth"], warming.temperature_k if warming.time_s is None else None
    start_k = float(recorded[0]) if recorded is not None else ROOM_K
    values = {
        "fixed_end_m": term.get("fixed_end_m", 0.0),
        "reference_k": start_k,
        "start_k": start_k,
        "ambient_k": start_k,
    }
    alpha_1_k = STEEL_1_K if recorded is None else growth
    if recorded is None:
        notes.append("thermal_expansion: no temperature was recorded; a screw of steel is taken")
    balance = _balance(warming, growth / alpha_1_k)
    if warming.time_s is not None and (
        growth < 0.0 or balance.heat_capacity_j_k < LEAST_J_K or balance.resistance_k_w > MOST_K_W
    ):  # not by its own friction: the screw goes over to the temperature of its surroundings
        return {
            **values,
            "expansion_1_k": alpha_1_k,
            "ambient_k": start_k + growth / alpha_1_k,
            "heat_capacity_j_k": warming.time_s,
            "resistance_k_w": 1.0,
            "heat_share": 0.0,
        }
    return {
        **values,
        "expansion_1_k": alpha_1_k,
        "heat_capacity_j_k": balance.heat_capacity_j_k,
        "resistance_k_w": balance.resistance_k_w,
        "heat_share": 1.0,
    }


def _warming(found: Found) -> Warming:
    scene = found.scenes[0]
    speed_m_s = np.abs(scene.motion.velocity_m_s)
    coulomb_n = found.base.get("coulomb_n", found.axis.coulomb_n)
    viscous_n_s_m = found.base.get("viscous_n_s_m", found.axis.viscous_n_s_m)
    friction_w = speed_m_s * np.maximum(coulomb_n + viscous_n_s_m * speed_m_s, 0.0)
    return Warming(friction_w, scene.period_s, found.terms[0].get("time_s"), scene.temperature_k)


def _balance(warming: Warming, rise_k: float) -> Balance:
    """By the recorded temperature; without one, the mean power leads to `rise_k` in the time found.

    Raises:
        NotInAPlant: friction does not heat the axis.

    """
    mean_w = float(warming.friction_w.mean())
    if warming.time_s is not None:
        if mean_w <= 0.0:
            raise NotInAPlant("there is no friction that could heat the axis")
        return Balance(rise_k, warming.time_s * mean_w / rise_k, rise_k / mean_w)
    assert warming.temperature_k is not None  # noqa: S101  # it or a time constant
    warmth_k = warming.temperature_k - warming.temperature_k[0]
    # T = (1/C) int P dt - (1/RC) int T dt
    columns = np.cumsum(np.stack((warming.friction_w, -warmth_k), axis=1), axis=0) * warming.period_s
    per_joule, per_second = np.linalg.lstsq(columns, warmth_k)[0]
    highest_k = float(warmth_k.max())
    if highest_k <= 0.0 or per_joule <= 0.0 or per_second <= 0.0:
        raise NotInAPlant("the recorded temperature does not follow from the axis' own friction")
    return Balance(highest_k, 1.0 / float(per_joule), float(per_joule / per_second))
