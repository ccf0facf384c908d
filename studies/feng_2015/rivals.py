"""Rivals of the learned compensations on the motions of the study, each tuned as in `rival_tuning`.

- observer: first-order disturbance observer, over its bandwidth;
- friction: feedforward of the identified friction with memory (Maxwell slip), without a learned waveform;
- observer and friction: the observer knows the feedforward, so that friction is not compensated twice;
- sliding mode and active disturbance rejection: see `published_loops`;
- QEC: a pulse of one duration whose height is a characteristic over the reverse acceleration, as in the
  quadrant error compensation of commercial controls; adapted: its duration is a characteristic too.
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from hil_sim.config import PlantConfig
from servo_ctrl.config.kernel_params import with_pulse
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.reversal_waveform import SLOPES, WaveformLearned
from studies.feng_2015.published_loops import disturbance_rejection, sliding_mode, with_bandwidth
from studies.feng_2015.rival_tuning import Setting, TunedRival, Tuner, planned_n, robustness
from studies.feng_2015.twin_motions import Planned, TwinProgram, twin_figures

BANDWIDTHS_HZ = (3.0, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
"""Bandwidths of the observers; chosen: from the slowest with any effect to beyond Ms = 2."""
DURATIONS_S = (0.03, 0.05, 0.08, 0.12)
"""Durations of the pulse of QEC; chosen: around the interval to the peak of the error."""
HEIGHTS = 8
"""Number of heights of the pulse of QEC, up to A_max; chosen."""


def quadrant_error_compensation(tuner: Tuner) -> tuple[list[Setting], list[Setting]]:
    """Return one setting for each duration, with the best heights; and one with the best pairs of both."""
    tried = np.linspace(0.0, tuner.params.pulse.amplitude_max_m_s, HEIGHTS + 1)
    scores_um = np.array(
        [
            [
                [
                    tuner.evaluation_um(
                        Setting({}, _pulse(tuner.params, [a_m_s2], [duration_s], [height])), a_m_s2
                    )
                    for height in tried
                ]
                for a_m_s2 in tuner.accelerations_m_s2
            ]
            for duration_s in DURATIONS_S
        ]
    )
    best = scores_um.argmin(axis=2)
    fixed = [
        _characteristic(tuner, [duration_s] * len(tuner.accelerations_m_s2), tried[best[place]].tolist())
        for place, duration_s in enumerate(DURATIONS_S)
    ]
    places = scores_um.min(axis=2).argmin(axis=0).tolist()
    heights = [float(tried[best[place, column]]) for column, place in enumerate(places)]
    return fixed, [_characteristic(tuner, [DURATIONS_S[place] for place in places], heights)]


def _characteristic(tuner: Tuner, durations_s: list[float], heights: list[float]) -> Setting:
    described = {
        "duration_ms": [1e3 * duration_s for duration_s in durations_s],
        "heights_mm_s": [1e3 * height for height in heights],
    }
    return Setting(described, _pulse(tuner.params, tuner.accelerations_m_s2, durations_s, heights))


def _pulse(
    params: AxisParams, accelerations_m_s2: list[float], durations_s: list[float], heights: list[float]
) -> AxisParams:
    none = np.zeros(len(heights))
    return with_pulse(
        params, np.array([accelerations_m_s2, durations_s, heights, none, none, none], dtype=float)
    )


def tuned_rivals(
    machine: MachineConfig, plant: PlantConfig, axis: str, friction: tuple[float, ...]
) -> list[TunedRival]:
    """Return every rival tuned on one axis; `friction`: as identified by the learner."""
    tuner = Tuner(machine, plant, axis)
    plain = tuner.params
    fast = [(hz, with_bandwidth(plain, hz)) for hz in BANDWIDTHS_HZ]
    both = [
        Setting({"bandwidth_hz": hz}, params, friction, params.observer.filter_blend) for hz, params in fast
    ]
    fixed, adapted = quadrant_error_compensation(tuner)
    return [
        tuner.best("observer", [Setting({"bandwidth_hz": hz}, params) for hz, params in fast]),
        tuner.best("friction feedforward", [Setting({"level_n": friction[:-SLOPES]}, plain, friction)]),
        tuner.best("observer and friction feedforward", both),
        tuner.best("sliding mode", sliding_mode(tuner)),
        tuner.best("active disturbance rejection", disturbance_rejection(tuner)),
        tuner.best("quadrant error compensation", fixed),
        tuner.best("quadrant error compensation, adapted", adapted),
    ]


def rival_figures(
    machine: MachineConfig, plant: PlantConfig, program: TwinProgram, learned: dict[str, WaveformLearned]
) -> list[dict[str, Any]]:
    """Return name, setting, robustness, curve and the four indicators (um) on every motion, of every rival.

    Axes, then rivals, have a thread each: the compiled loop of the twin holds no interpreter lock.
    """
    with ThreadPoolExecutor() as threads:
        found = threads.map(
            lambda axis: tuned_rivals(machine, plant, axis, learned[axis].friction), list(learned)
        )
        tuned = dict(zip(learned, found, strict=True))
        places = range(len(next(iter(tuned.values()))))
        return list(
            threads.map(
                lambda place: _measured(
                    machine, plant, program, {axis: entries[place] for axis, entries in tuned.items()}
                ),
                places,
            )
        )


def _measured(
    machine: MachineConfig, plant: PlantConfig, program: TwinProgram, tuned: dict[str, TunedRival]
) -> dict[str, Any]:
    settings = {axis: rival.setting for axis, rival in tuned.items()}
    params = {axis: setting.params for axis, setting in settings.items()}
    figures = twin_figures(machine, plant, program, params, _along(settings))
    return {
        "name": next(iter(tuned.values())).name,
        "setting": {axis: setting.described for axis, setting in settings.items()},
        "robustness": {axis: robustness(setting.params) for axis, setting in settings.items()},
        "curve": {axis: rival.curve for axis, rival in tuned.items()},
        "motions": [
            {"axis": axis, "label": label, **values._asdict()} for (axis, label), values in figures.items()
        ],
    }


def _along(settings: dict[str, Setting]) -> Planned:
    return lambda axis, commands: planned_n(settings[axis], commands)
