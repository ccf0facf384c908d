"""Thermal expansion: scale less motor drifts slowly, in proportion to the position."""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.transmission import thermal_expansion as physics
from kernels.arrays import Array
from reconcile.catalogue import lead_error_cumulative
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.entry import CatalogueEntry
from reconcile.catalogue.heat_balance import (
    balance_of,
    friction_power_w,
    recorded_start_k,
    rise,
    temperature_changes,
    too_little_warming,
)
from reconcile.catalogue.kinds import (
    EITHER,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    SiParameter,
    TermFamily,
)

DEVIATION = ResidualChannel.POSITION_DEVIATION
TIMES_S = (10.0, 30.0, 100.0, 400.0)
SHORTEST_S = 20.0
"""Least length of a recording for a drift without recorded temperature to be a warming screw, which takes
minutes: in less time any slow change resembles it. Chosen."""
STEEL_1_K = 12e-6
"""Expansion of a steel screw, used without recorded temperature: the law depends only on its product with the
rise."""
ROOM_K = 293.15


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    start_k = recorded_start_k(datasets)
    if start_k is not None:
        return [(0.0, start_k)] if temperature_changes(datasets) else []
    longest_s = max(float(data.time_s[-1]) for data in datasets)
    times = TIMES_S if longest_s >= SHORTEST_S else ()
    return [(time, 0.0) for time in times if time < 5.0 * longest_s]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    x, warmer = data.motion.position_m, rise(data, shape)
    if shape[0] == 0.0:
        return np.stack((x * warmer, warmer), axis=1)
    return np.stack((x * warmer, warmer, x), axis=1)  # how warm it was at the start is not known


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """Growth per metre (per kelvin where the temperature was recorded), and what it is measured from."""
    growth = float(coefficients[0])
    found = {"growth": SiParameter(growth, "1/K" if shape[0] == 0.0 else "")}
    if growth != 0.0:
        found["fixed_end_m"] = SiParameter(-float(coefficients[1]) / growth, "m")
    return found if shape[0] == 0.0 else {**found, "time_s": SiParameter(shape[0], "s")}


def _to_plant(found: IdentifiedTerms, notes: list[str]) -> PlantValues:
    """A growth over the run, or per kelvin."""
    term, data, bounds = found.terms[0], found.datasets[0], ENTRY.bounds
    growth, recorded = term["growth"], data.temperature_k if "time_s" not in term else None
    start_k = float(recorded[0]) if recorded is not None else ROOM_K
    alpha_1_k = STEEL_1_K if recorded is None else growth
    if recorded is None:
        notes.append(f"{ENTRY.name}: no temperature was recorded; a screw of steel is taken")
    balance = balance_of(found, growth / alpha_1_k)
    values = {
        "expansion_1_k": alpha_1_k,
        "fixed_end_m": term.get("fixed_end_m", 0.0),
        "reference_k": start_k,
        "start_k": start_k,
        "ambient_k": start_k,
        "heat_capacity_j_k": balance.heat_capacity_j_k,
        "resistance_k_w": balance.resistance_k_w,
        "heat_share": 1.0,
    }
    if "time_s" in term and (
        growth < 0.0
        or balance.heat_capacity_j_k < bounds["heat_capacity_j_k"].lower
        or balance.resistance_k_w > bounds["resistance_k_w"].upper
    ):  # not by its own friction: the screw takes the temperature of its surroundings
        values |= {
            "ambient_k": start_k + growth / alpha_1_k,
            "heat_capacity_j_k": term["time_s"],
            "resistance_k_w": 1.0,
            "heat_share": 0.0,
        }
    return values


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """Growth from the start on; a screw that is not at its reference then has a lead error from the start."""
    p = of.params
    at_start = p.expansion_1_k * (p.start_k - p.reference_k)
    from_the_start = ModelTerm(lead_error_cumulative.ENTRY.name, (), (at_start,), DEVIATION)
    start_k = recorded_start_k(of.datasets)
    if start_k is not None:  # the screw has the temperature that was recorded
        growing = (p.expansion_1_k, -p.expansion_1_k * p.fixed_end_m)
        return [ModelTerm(of.effect, (0.0, start_k), growing, DEVIATION), from_the_start]
    power_w = float(friction_power_w(of.datasets[0], of.base).mean())
    final_k = p.ambient_k + p.heat_share * power_w * p.resistance_k_w
    growth = p.expansion_1_k * (final_k - p.start_k)
    if growth == 0.0:
        return [from_the_start]
    coefficients = (growth, -growth * p.fixed_end_m, at_start)
    time_s = p.resistance_k_w * p.heat_capacity_j_k
    return [ModelTerm(of.effect, (time_s, 0.0), coefficients, DEVIATION)]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes, DEVIATION, EITHER),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"the scale drifts away from the motor in proportion to the position, by {p['growth'] * 1e6:.1f} "
        "um/m: the screw grows as it warms; a lead error would have been there from the start"
    ),
    to_plant=_to_plant,
    from_plant=_from_plant,
    refused=too_little_warming,
    shown_by="the scale drifts in proportion to the position",
    experiment="warm",
)
