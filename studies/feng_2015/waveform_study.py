"""Learned waveforms and their rivals on the motions of the study, in the batch twin."""

import time
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning.reversal_waveform import compensation_n
from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.rivals import rival_figures
from studies.feng_2015.twin_motions import twin_figures, twin_program
from studies.feng_2015.variants import study_program
from studies.feng_2015.waveform_learning import LearnedWaveforms, learn_waveforms
from twin.plant_file import load_plant

WAVEFORM = "LWC"


class WaveformStudy(NamedTuple):
    """`figures`: (axis or "S", label) to the indicators; `rivals` for JSON, see `rivals.rival_figures`."""

    figures: dict[tuple[str, str], ReversalFigures]
    axes: dict[str, LearnedWaveforms]
    rivals: list[dict[str, Any]]
    wall_s: float


def study_waveforms(machine: Path) -> WaveformStudy:
    """Learn on sines, judge on the circles and S-shaped motions, rivals too."""
    begun_s = time.perf_counter()
    config, plant = load_machine(machine), load_plant(machine)
    axes = {name: learn_waveforms(config, plant, name) for name in config.axes}
    learned = {name: entry.learned for name, entry in axes.items()}
    program = twin_program(config, study_program(machine))
    figures = twin_figures(
        config,
        plant,
        program,
        {name: axis_params(config, name) for name in config.axes},
        lambda axis, commands: compensation_n(learned[axis], commands, config.period_s),
    )
    rivals = rival_figures(config, plant, program, learned)
    return WaveformStudy(figures, axes, rivals, time.perf_counter() - begun_s)


def learning_figures(study: WaveformStudy) -> dict[str, Any]:
    """Strokes, and J from stroke to stroke at each acceleration, for JSON."""
    return {
        "made": "batch twin",
        "wall_s": study.wall_s,
        "axes": {
            axis: {
                "strokes": entry.strokes,
                "courses": [
                    {"acceleration_mm_s2": 1e3 * a, "J_um": [1e6 * j for j in course]}
                    for a, course in entry.course_m.items()
                ],
            }
            for axis, entry in study.axes.items()
        },
    }
