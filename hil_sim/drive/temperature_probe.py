"""A resistance thermometer (Pt1000) at the guide of an axis: lag of the sensor, noise, resolution.

    tau dT/dt = Ta + r - T,    n = round((T + e) / q)

r is the rise of the lubricant over its surroundings Ta, tau the thermal response time of sensor and mounting
(first order), e the noise of the converter, q the step of the object. Between two readings r is taken as
constant.
"""

import math
from typing import Any

import numpy as np

from hil_sim.config import AxisPlant, Plant, TemperatureProbe

STEP_K = 0.1
"""q; chosen: common resolution of the temperature objects of drives."""


class ProbeReading:
    """The probe and its memory; `seed` is that of its noise."""

    def __init__(self, probe: TemperatureProbe, seed: int) -> None:
        self._probe, self._rng = probe, np.random.default_rng(seed)
        self._sensor_degc = math.nan
        self._read_s = 0.0

    def counts(self, now_s: float, rise_k: float) -> int:
        """Return the reading (`STEP_K`) at a time and a rise of the lubricant; the first has no lag."""
        around_degc = self._probe.surroundings_degc + rise_k
        if math.isnan(self._sensor_degc):
            self._sensor_degc = around_degc
        kept = math.exp(-(now_s - self._read_s) / self._probe.lag_s)
        self._sensor_degc = around_degc + (self._sensor_degc - around_degc) * kept
        self._read_s = now_s
        return round((self._sensor_degc + self._probe.noise_k * self._rng.standard_normal()) / STEP_K)


class GuideThermometer:
    """The probe on axis `index` of the plant."""

    def __init__(self, probe: TemperatureProbe, plant: Plant, index: int) -> None:
        self._reading = ProbeReading(probe, index)
        self._warmth: Any = plant.state[index]["temperature_dependent_friction"]

    def counts(self, now_s: float) -> int:
        """Return the reading (`STEP_K`)."""
        return self._reading.counts(now_s, float(self._warmth["temperature_rise_k"]))


def thermometer_of(config: AxisPlant, plant: Plant, index: int) -> GuideThermometer | None:
    """Return the thermometer of an axis; None where the plant file has none."""
    probe = config.temperature_probe
    return None if probe is None else GuideThermometer(probe, plant, index)
