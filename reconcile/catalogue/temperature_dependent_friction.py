"""Friction that changes as the axis warms up: with the temperature, or with the run time."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from hil_sim.physics.friction import temperature_dependent_friction as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, NotInAPlant, PlantValues
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.heat_balance import (
    balance_of,
    friction_power_w,
    recorded_start_k,
    rise,
    temperature_changes,
    too_little_warming,
)
from reconcile.catalogue.kinds import EITHER, RegressionData, ShapeParameters, SiParameter, TermFamily

TIMES_S = (5.0, 15.0, 50.0, 200.0)
WARM_K = 10.0
"""Largest rise of the written plant; the law depends only on its ratio to `warmth_scale_k`."""
LEAST_SATURATION = 0.1
"""Least saturation 1 - exp(-rise / scale) of the written plant, whose law is nearly linear up to there."""
MOST_LOSS = 0.95
"""Largest share of the cold friction that the written plant loses by warming."""
LEAST_COVERED = 1.0 / 3.0
"""Least duration of a recording over the time constant of a term that is tried."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    start_k = recorded_start_k(datasets)
    if start_k is not None:
        return [(0.0, start_k)] if temperature_changes(datasets) else []
    longest_s = max(float(data.time_s[-1]) for data in datasets)
    times_s = [time for time in TIMES_S if time < 3.0 * longest_s]
    # each recording may start at another, unknown temperature: one level each
    own = [(time, 0.0, 1.0) for time in times_s] if len(datasets) > 1 else []
    return [*((time, 0.0) for time in times_s), *own]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    m, warmer = data.motion, rise(data, shape)
    drift = (m.direction * warmer, m.velocity_m_s * warmer)
    return np.stack((*drift, m.direction, m.velocity_m_s) if len(shape) > 2 else drift, axis=1)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """Change of level and slope: per kelvin where the temperature was recorded, else in the end."""
    found = {
        "level_n": SiParameter(float(coefficients[0]), "N"),
        "viscous_n_s_m": SiParameter(float(coefficients[1]), "N s/m"),
    }
    return found if shape[0] == 0.0 else {**found, "time_s": SiParameter(shape[0], "s")}


def _to_plant(found: IdentifiedTerms, notes: list[str]) -> PlantValues:
    """Changes as shares of the cold friction."""
    term, bounds = found.terms[0], ENTRY.bounds
    balance = balance_of(found, WARM_K)
    per_kelvin = balance.rise_k if "time_s" not in term else 1.0
    scale = min(
        WARM_K / balance.rise_k,
        balance.heat_capacity_j_k / bounds["heat_capacity_j_k"].lower,
        bounds["resistance_k_w"].upper / balance.resistance_k_w,
    )
    rise_k = balance.rise_k * scale
    share = {}
    for key in ("level_n", "viscous_n_s_m"):
        cold = found.base["coulomb_n" if key == "level_n" else key]
        change = term[key] * per_kelvin
        share[key] = change / cold if cold > 0.0 else 0.0
        if share[key] < -MOST_LOSS:
            notes.append(
                f"{ENTRY.name}.{key} was found to be {term[key]:.4g}, of {cold:.4g}; it is "
                f"written as {100.0 * MOST_LOSS:.0f} % of that"
            )
            share[key] = -MOST_LOSS
    if not any(share.values()):
        raise NotInAPlant("there is no friction that could change")
    highest_share = bounds["warm_level_share"].upper - 1.0
    # the least saturation that allows these changes within the plant's bounds
    needed = max(LEAST_SATURATION, -min(share.values()), max(share.values()) / highest_share)
    saturation = min(needed, MOST_LOSS)
    return {
        "warm_level_share": 1.0 + share["level_n"] / saturation,
        "warm_damping_share": 1.0 + share["viscous_n_s_m"] / saturation,
        "warmth_scale_k": -rise_k / math.log1p(-saturation),
        "heat_capacity_j_k": balance.heat_capacity_j_k / scale,
        "resistance_k_w": balance.resistance_k_w * scale,
    }


class _Drift(NamedTuple):
    """Warming of an axis in the first recording."""

    shape_parameters: ShapeParameters
    """A time constant, or 0 and the temperature at the start."""
    column: float
    """Largest drift of the columns: a share of the final one, or kelvin as recorded."""
    rise_k: float
    """Temperature rise of the plant at that drift."""


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """The plant's law saturates as it warms; the term is the straight line to its warmest point."""
    p, drift = of.params, _drift(of)
    if drift.column <= 0.0:
        return []
    change = -math.expm1(-drift.rise_k / p.warmth_scale_k) / drift.column
    coefficients = (
        of.base["coulomb_n"] * (p.warm_level_share - 1.0) * change,
        of.base["viscous_n_s_m"] * (p.warm_damping_share - 1.0) * change,
    )
    return [ModelTerm(of.effect, drift.shape_parameters, coefficients)]


def _drift(of: ModelEffect) -> _Drift:
    """Return the drift by the recorded temperature if all recordings have one, else by the mean power."""
    p, data = of.params, of.datasets[0]
    time_s, power_w = p.resistance_k_w * p.heat_capacity_j_k, friction_power_w(data, of.base)
    start_k = recorded_start_k(of.datasets)
    if start_k is None or data.temperature_k is None:
        longest_s = max(float(one.time_s[-1]) for one in of.datasets)
        share = 1.0 if longest_s >= LEAST_COVERED * time_s else -math.expm1(-longest_s / time_s)
        return _Drift((time_s, 0.0), share, float(power_w.mean()) * p.resistance_k_w * share)
    kept = math.exp(-data.period_s / time_s)
    plant_k = lfilter([0.0, p.resistance_k_w * (1.0 - kept)], [1.0, -kept], power_w)
    recorded_k = data.temperature_k - start_k
    highest_k = float(recorded_k.max())
    squares = float(recorded_k @ recorded_k)
    return _Drift((0.0, start_k), highest_k, highest_k * float(recorded_k @ plant_k) / max(squares, 1e-300))


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes, per_recording=EITHER),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"friction drifts while the axis runs, by {p['level_n']:.2f} N and {p['viscous_n_s_m']:.1f} N s/m: "
        "it changes with the temperature of the lubricant; wear would not come back after cooling"
    ),
    drifting_columns=2,
    presliding_can_imitate=True,
    shows_after_presliding=True,
    to_plant=_to_plant,
    from_plant=_from_plant,
    refused=too_little_warming,
    shown_by="friction falls with warmth, and comes back",
    experiment="warm",
)
