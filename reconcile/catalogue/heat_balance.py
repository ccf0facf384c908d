"""Lumped heat balance C dT/dt = P - T / R, P the friction power: shared by the thermal effects."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, NotInAPlant
from reconcile.catalogue.kinds import RegressionData, ShapeParameters

LEAST_CHANGE_K = 2.0
"""Least change of a recorded temperature for a thermal effect to be tried; chosen."""
LEAST_NOISE_RATIO = 10.0
"""The same least change, in standard deviations of the sensor's noise; chosen."""
MOST_TIME_RATIO = 10.0
"""Largest time constant over the longest recording: within a tenth of it, warming is a line over time."""


class Balance(NamedTuple):
    """A heat balance, and its temperature rise above the start."""

    rise_k: float
    heat_capacity_j_k: float
    resistance_k_w: float


def friction_power_w(data: RegressionData, base: Mapping[str, float]) -> Array:
    """Power (n,) with which Coulomb and viscous friction heat the axis."""
    speed_m_s = np.abs(data.motion.velocity_m_s)
    power_w: Array = speed_m_s * (base["coulomb_n"] + base["viscous_n_s_m"] * speed_m_s)
    return power_w


def recorded_start_k(datasets: Sequence[RegressionData]) -> float | None:
    """Temperature at the start of the first recording; None unless all of them have it."""
    recorded = [data.temperature_k for data in datasets if data.temperature_k is not None]
    return float(recorded[0][0]) if len(recorded) == len(datasets) else None


def temperature_changes(datasets: Sequence[RegressionData]) -> bool:
    """Return whether the recorded temperature changes enough to show a thermal effect."""
    recorded = [data.temperature_k for data in datasets if data.temperature_k is not None]
    highest_k = max(float(np.percentile(of, 99.0)) for of in recorded)
    lowest_k = min(float(np.percentile(of, 1.0)) for of in recorded)
    noise_k = max(float(np.std(np.diff(of))) for of in recorded) / math.sqrt(2.0)
    return highest_k - lowest_k >= max(LEAST_CHANGE_K, LEAST_NOISE_RATIO * noise_k)


def too_little_warming(found: IdentifiedTerms) -> str:
    """Return why no thermal effect can be there (`CatalogueEntry.refused`); empty if it can."""
    time_s = found.terms[0].get("time_s")
    if time_s is not None:
        longest_s = max(float(data.time_s[-1]) for data in found.datasets)
        if time_s <= MOST_TIME_RATIO * longest_s:
            return ""
        return f"a warming of {time_s:.3g} s is a straight line over time in {longest_s:.3g} s"
    if recorded_start_k(found.datasets) is None or temperature_changes(found.datasets):
        return ""
    return f"the recorded temperature changes by less than {LEAST_CHANGE_K:g} K, or than its own noise"


def rise(data: RegressionData, shape: ShapeParameters) -> Array:
    """Rise of the temperature (n,): kelvin as recorded above `shape[1]`, or the share by a time constant."""
    if shape[0] == 0.0 and data.temperature_k is not None:
        return data.temperature_k - shape[1]
    return -np.expm1(-data.time_s / shape[0])


def balance_of(found: IdentifiedTerms, rise_k: float) -> Balance:
    """Return the balance by the recorded temperature, else by mean power, `rise_k` and the time constant.

    Raises:
        NotInAPlant: friction does not heat the axis.

    """
    data, time_s = found.datasets[0], found.terms[0].get("time_s")
    speed_m_s = np.abs(data.motion.velocity_m_s)
    coulomb_n = found.base.get("coulomb_n", found.axis.coulomb_n)
    viscous_n_s_m = found.base.get("viscous_n_s_m", found.axis.viscous_n_s_m)
    friction_w = speed_m_s * np.maximum(coulomb_n + viscous_n_s_m * speed_m_s, 0.0)
    if time_s is not None:
        mean_w = float(friction_w.mean())
        if mean_w <= 0.0:
            raise NotInAPlant("there is no friction that could heat the axis")
        return Balance(rise_k, time_s * mean_w / rise_k, rise_k / mean_w)
    assert data.temperature_k is not None  # noqa: S101  # it or a time constant
    recorded_rise_k = data.temperature_k - data.temperature_k[0]
    # T = (1/C) int P dt - (1/RC) int T dt
    columns = np.cumsum(np.stack((friction_w, -recorded_rise_k), axis=1), axis=0) * data.period_s
    per_joule, per_second = np.linalg.lstsq(columns, recorded_rise_k)[0]
    highest_k = float(recorded_rise_k.max())
    if highest_k <= 0.0 or per_joule <= 0.0 or per_second <= 0.0:
        raise NotInAPlant("the recorded temperature does not follow from the axis' own friction")
    return Balance(highest_k, 1.0 / float(per_joule), float(per_joule / per_second))
