"""Tunes the rivals of the learned compensations: one rule for all, on the learning strokes (batch twin).

A setting is allowed where Ms <= 2 on the rigid mass and the noise gain is within `NOISE_SHARE`. Of the
allowed settings the one with the least mean J counts, over strokes of the learning radius at accelerations
of the pulse's learner. Feedforward rivals keep the gains of the loop.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.config.kernel_params import with_waveform
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation import learned_waveform, trapezoidal_pulse
from servo_ctrl.control.loop_margins import noise_gain_n_m, sensitivity_peak
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import AxisSample
from servo_ctrl.learning.performance import evaluation_m, reversals, window_samples
from studies.feng_2015.waveform_learning import ErrorStrokes


def force_along(params: AxisParams, commands: Array) -> Array:
    """Return the force (n,), newtons, along the commands (n, >= 3) of one axis, which start at standstill.

    Columns of the commands: position m, velocity m/s, acceleration m/s^2.
    """
    return _along(params, np.ascontiguousarray(commands[:, :3], np.float64))


@kernel
def _along(params: AxisParams, commands: Array) -> Array:
    pulse = trapezoidal_pulse.at_rest(commands[0, 0])
    state = learned_waveform.at_rest(commands[0, 0])
    force_n = np.zeros(len(commands))
    for k in range(len(commands)):
        sample = AxisSample(
            commands[k, 0], commands[k, 1], commands[k, 2], 0.0, math.nan, math.nan, math.nan, 0.0
        )
        pulse = trapezoidal_pulse.advance_pulse(params.pulse, pulse, sample, params.period_s)
        force_n[k], state = learned_waveform.planned_force(
            params.waveform, state, pulse, sample, params.period_s
        )
    return force_n


SENSITIVITY_LIMIT = 2.0
"""Bounds Ms of every rival; from the specification."""
NOISE_SHARE = 2.0
"""Bounds the noise in the force command, relative to the loop without compensation; chosen."""
TUNING_STROKES = 4
"""Number of accelerations over which J is averaged; chosen."""


class Setting(NamedTuple):
    """Parameters of the law and the force planned along the program, for one axis."""

    described: dict[str, Any]
    params: AxisParams
    friction: tuple[float, ...] | None = None
    observer_blend: float = 0.0
    """Filter blend of the observer that knows the planned force; 0 = there is no observer."""


class TunedRival(NamedTuple):
    """The best setting, and J (um) and robustness of every tried one."""

    name: str
    setting: Setting
    curve: list[dict[str, Any]]


def planned_n(setting: Setting, commands: Array) -> Array:
    """Return the force offset (n,), newtons, of a setting along the commands of an axis."""
    if setting.friction is None:
        return np.zeros(len(commands))
    params = with_waveform(setting.params, setting.friction)
    force_n = force_along(params, commands)
    if setting.observer_blend > 0.0:
        blend, dead = setting.observer_blend, round(params.waveform.lead_s / params.period_s)
        delayed_n = np.concatenate([np.zeros(dead), force_n[:-dead]])
        force_n -= lfilter([blend], [1.0, blend - 1.0], delayed_n)  # less the share that the observer adds
    return force_n


def robustness(params: AxisParams) -> dict[str, float]:
    """Return Ms, and RMS force per RMS position noise (N/um), on the rigid mass of the feedforward."""
    mass_kg = params.feedforward.acceleration_kg
    noise_n_um = noise_gain_n_m(params, mass_kg) * 1e-6
    return {"Ms": sensitivity_peak(params, mass_kg), "noise_n_um": noise_n_um}


class Tuner:
    """Evaluates settings on strokes of one axis."""

    def __init__(self, machine: MachineConfig, plant: PlantConfig, axis: str) -> None:
        self._strokes = ErrorStrokes(machine, plant, axis)
        self.params = self._strokes.params
        self._plain = robustness(self.params)
        limits = self._strokes.settings.sines.accelerations_m_s2
        self.accelerations_m_s2: list[float] = np.geomspace(limits[0], limits[-1], TUNING_STROKES).tolist()
        self._window = window_samples(self._strokes.settings.sines.window_s, self.params.period_s)

    def evaluation_um(self, setting: Setting, a_m_s2: float) -> float:
        """Return J at one acceleration."""
        reference = self._strokes.reference(a_m_s2)
        reference[:, 3] = planned_n(setting, reference)
        error_m = self._strokes.error_m(reference, setting.params)
        parts = [error_m[start : start + self._window] for start in reversals(reference[:, 0])]
        return 1e6 * float(np.mean([evaluation_m(part) for part in parts]))

    def mean_um(self, setting: Setting) -> float:
        """Return the mean J over all accelerations."""
        return float(np.mean([self.evaluation_um(setting, a) for a in self.accelerations_m_s2]))

    def allows(self, params: AxisParams) -> bool:
        """Return whether the loop is within both bounds."""
        found, plain = robustness(params), self._plain
        noise_limit_n_um = NOISE_SHARE * plain["noise_n_um"]
        return found["Ms"] <= SENSITIVITY_LIMIT and found["noise_n_um"] <= noise_limit_n_um

    def best(self, name: str, settings: list[Setting]) -> TunedRival:
        """Return the allowed setting with the least mean J."""
        curve = [
            {**entry.described, **robustness(entry.params), "J_um": self.mean_um(entry)} for entry in settings
        ]
        allowed = [i for i, entry in enumerate(settings) if self.allows(entry.params)]
        return TunedRival(name, settings[min(allowed, key=lambda i: float(curve[i]["J_um"]))], curve)
