"""Rivals of the learned compensations, tuned by one procedure on the learning strokes (batch twin).

Each may be as fast as Ms <= 2 on the rigid mass allows; of what is allowed, that setting counts whose mean J
over strokes of the learning radius, at accelerations of the waveforms' learner, is least.
Feedforwards leave the loop as it is: their Ms and noise are those without compensation.

- observer: first-order disturbance observer, over its bandwidth;
- friction: feedforward of the identified friction with memory (Maxwell slip), without a learned waveform;
- observer and friction: the observer knows the feedforward, so that neither counts twice;
- QEC: pulse of one duration whose height is a characteristic over the reverse acceleration, as quadrant error
  compensation of commercial controls has it.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.freeze import with_pulse, with_waveform
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.section import filter_blend
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.performance import evaluation_m, reversals, window_samples
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.metrology.loop_margins import noise_gain_n_m, sensitivity_peak
from studies.feng_2015.planned_force import force_along
from studies.feng_2015.twin_motions import Planned, TwinProgram, twin_figures
from studies.feng_2015.waveform_learning import ErrorStrokes

SENSITIVITY_LIMIT = 2.0
"""Ms of every rival; the issue's bound."""
BANDWIDTHS_HZ = (3.0, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
"""Of the observers; chosen: from the slowest that does anything to beyond Ms = 2."""
TUNING_STROKES = 4
"""Accelerations that J is the mean over; chosen."""
DURATIONS_S = (0.03, 0.05, 0.08, 0.12)
"""Of QEC's pulse; chosen: around the interval to the peak of the error."""
HEIGHTS = 8
"""Of QEC's pulse, up to A_max; chosen."""


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

    def best(self, name: str, settings: list[Setting]) -> TunedRival:
        """The rule: least mean J where Ms is within its limit."""
        curve = [
            {**entry.described, **robustness(entry.params), "J_um": self.mean_um(entry)} for entry in settings
        ]
        allowed = [i for i, point in enumerate(curve) if point["Ms"] <= SENSITIVITY_LIMIT]
        return TunedRival(name, settings[min(allowed, key=lambda i: float(curve[i]["J_um"]))], curve)


def with_bandwidth(params: AxisParams, bandwidth_hz: float) -> AxisParams:
    """With the observer at this bandwidth."""
    blend = filter_blend(1.0 / (2.0 * math.pi * bandwidth_hz), params.period_s)
    return params._replace(observer=params.observer._replace(enabled=True, filter_blend=blend))


def quadrant_error_compensation(tuner: Tuner) -> list[Setting]:
    """One setting for each duration, with the heights that are best at each acceleration."""
    found = []
    for duration_s in DURATIONS_S:
        heights = []
        for a_m_s2 in tuner.accelerations_m_s2:
            tried = np.linspace(0.0, tuner.params.pulse.amplitude_max_m_s, HEIGHTS + 1)
            scores = [
                tuner.evaluation_um(Setting({}, _pulse(tuner.params, [a_m_s2], duration_s, [height])), a_m_s2)
                for height in tried
            ]
            heights.append(float(tried[int(np.argmin(scores))]))
        described = {"duration_ms": 1e3 * duration_s, "heights_mm_s": [1e3 * height for height in heights]}
        params = _pulse(tuner.params, tuner.accelerations_m_s2, duration_s, heights)
        found.append(Setting(described, params))
    return found


def _pulse(
    params: AxisParams, accelerations_m_s2: list[float], duration_s: float, heights: list[float]
) -> AxisParams:
    none = np.zeros(len(heights))
    return with_pulse(
        params, np.array([accelerations_m_s2, none + duration_s, heights, none, none, none], dtype=float)
    )


def tuned_rivals(
    machine: MachineConfig, plant: PlantConfig, axis: str, friction: tuple[float, ...]
) -> list[TunedRival]:
    """Every rival on one axis; `friction`: as the learner has identified it."""
    tuner = Tuner(machine, plant, axis)
    plain = tuner.params
    fast = [(hz, with_bandwidth(plain, hz)) for hz in BANDWIDTHS_HZ]
    both = [
        Setting({"bandwidth_hz": hz}, params, friction, params.observer.filter_blend) for hz, params in fast
    ]
    return [
        tuner.best("observer", [Setting({"bandwidth_hz": hz}, params) for hz, params in fast]),
        tuner.best("friction feedforward", [Setting({"level_n": friction[:-2]}, plain, friction)]),
        tuner.best("observer and friction feedforward", both),
        tuner.best("quadrant error compensation", quadrant_error_compensation(tuner)),
    ]


def rival_figures(
    machine: MachineConfig,
    plant: PlantConfig,
    program: TwinProgram,
    learned: dict[str, WaveformLearned],
) -> list[dict[str, Any]]:
    """Name, setting, robustness, curve and the four indicators (um) on every motion, of every rival."""
    tuned = {axis: tuned_rivals(machine, plant, axis, entry.friction) for axis, entry in learned.items()}
    rivals = []
    for place, first in enumerate(next(iter(tuned.values()))):
        settings = {axis: entries[place].setting for axis, entries in tuned.items()}
        params = {axis: setting.params for axis, setting in settings.items()}
        figures = twin_figures(machine, plant, program, params, _along(settings))
        rivals.append(
            {
                "name": first.name,
                "setting": {axis: setting.described for axis, setting in settings.items()},
                "robustness": {axis: robustness(setting.params) for axis, setting in settings.items()},
                "curve": {axis: entries[place].curve for axis, entries in tuned.items()},
                "motions": [
                    {"axis": axis, "label": label, **values._asdict()}
                    for (axis, label), values in figures.items()
                ],
            }
        )
    return rivals


def _along(settings: dict[str, Setting]) -> Planned:
    return lambda axis, commands: planned_n(settings[axis], commands)
