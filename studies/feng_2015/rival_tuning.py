"""How a rival of the learned compensations is tuned: one rule for all, on the learning strokes (batch twin).

Each may be as fast as Ms <= 2 allows on the rigid mass, and as noisy as `NOISE_SHARE` allows. Of what is
allowed, that setting counts whose mean J over strokes of the learning radius, at accelerations that the
pulse's learner has, is least. Feedforwards leave the loop as it is.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.freeze import with_waveform
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.performance import evaluation_m, reversals, window_samples
from servo_ctrl.metrology.loop_margins import noise_gain_n_m, sensitivity_peak
from studies.feng_2015.planned_force import force_along
from studies.feng_2015.waveform_learning import ErrorStrokes

SENSITIVITY_LIMIT = 2.0
"""Ms of every rival; the issue's bound."""
NOISE_SHARE = 2.0
"""Bounds the noise in the force command, against the loop without compensation; chosen."""
TUNING_STROKES = 4
"""Accelerations that J is the mean over; chosen."""


class Setting(NamedTuple):
    """Parameters of the law and the force planned along the program, for one axis."""

    described: dict[str, Any]
    params: AxisParams
    friction: tuple[float, ...] | None = None
    observer_blend: float = 0.0
    """Of the observer that knows the planned force; 0 = none is."""


class TunedRival(NamedTuple):
    """The setting that counts, and J (um) of every one that was tried, with its robustness."""

    name: str
    setting: Setting
    curve: list[dict[str, Any]]


def planned_n(setting: Setting, commands: Array) -> Array:
    """The force offset (n,) of a setting along the commands of an axis."""
    if setting.friction is None:
        return np.zeros(len(commands))
    params = with_waveform(setting.params, setting.friction)
    force_n = force_along(params, commands)
    if setting.observer_blend > 0.0:
        blend, dead = setting.observer_blend, round(params.waveform.lead_s / params.period_s)
        late_n = np.concatenate([np.zeros(dead), force_n[:-dead]])
        force_n -= lfilter([blend], [1.0, blend - 1.0], late_n)  # what the observer will have of it
    return force_n


def robustness(params: AxisParams) -> dict[str, float]:
    """Ms, and the RMS force per RMS of position noise, on the rigid mass of the feedforward."""
    mass_kg = params.feedforward.acceleration_kg
    noise_n_um = noise_gain_n_m(params, mass_kg) * 1e-6
    return {"Ms": sensitivity_peak(params, mass_kg), "noise_n_um": noise_n_um}


class Tuner:
    """Strokes of one axis that score settings."""

    def __init__(self, machine: MachineConfig, plant: PlantConfig, axis: str) -> None:
        self._strokes = ErrorStrokes(machine, plant, axis)
        self.params = self._strokes.params
        self._plain = robustness(self.params)
        limits = self._strokes.settings.sines.accelerations_m_s2
        self.accelerations_m_s2: list[float] = np.geomspace(limits[0], limits[-1], TUNING_STROKES).tolist()
        self._window = window_samples(self._strokes.settings.sines.window_s, self.params.period_s)

    def evaluation_um(self, setting: Setting, a_m_s2: float) -> float:
        """J at one acceleration."""
        reference = self._strokes.reference(a_m_s2)
        reference[:, 3] = planned_n(setting, reference)
        error_m = self._strokes.error_m(reference, setting.params)
        parts = [error_m[start : start + self._window] for start in reversals(reference[:, 0])]
        return 1e6 * float(np.mean([evaluation_m(part) for part in parts]))

    def mean_um(self, setting: Setting) -> float:
        """Mean J over all accelerations."""
        return float(np.mean([self.evaluation_um(setting, a) for a in self.accelerations_m_s2]))

    def allows(self, params: AxisParams) -> bool:
        """Whether the loop is within both bounds."""
        found, plain = robustness(params), self._plain
        noise_limit_n_um = NOISE_SHARE * plain["noise_n_um"]
        return found["Ms"] <= SENSITIVITY_LIMIT and found["noise_n_um"] <= noise_limit_n_um

    def best(self, name: str, settings: list[Setting]) -> TunedRival:
        """The rule: least mean J of what is allowed."""
        curve = [
            {**entry.described, **robustness(entry.params), "J_um": self.mean_um(entry)} for entry in settings
        ]
        allowed = [i for i, entry in enumerate(settings) if self.allows(entry.params)]
        return TunedRival(name, settings[min(allowed, key=lambda i: float(curve[i]["J_um"]))], curve)
