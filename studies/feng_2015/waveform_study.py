"""Learned waveforms on the motions of the study, and their rivals in the batch twin."""

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.store import WaveformStore
from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.rivals import rival_figures
from studies.feng_2015.twin_motions import twin_program
from studies.feng_2015.variants import study_program
from studies.feng_2015.waveform_learning import LearnedWaveforms, learn_waveforms
from twin.plant_file import load_plant

WAVEFORM = "LWC"


class WaveformStudy(NamedTuple):
    """Figures by (axis or "S", label) of the motion; `rivals` for JSON, see `rivals.rival_figures`."""

    figures: dict[tuple[str, str], ReversalFigures]
    axes: dict[str, LearnedWaveforms]
    rivals: list[dict[str, Any]]
    wall_s: float


def learn_all(machine: Path, store: Path) -> WaveformStudy:
    """Learn on sines in the batch twin and store the results; tune and measure the rivals. No figures yet.

    The axes learn in parallel, a thread each: the compiled loop of the twin holds no interpreter lock.
    """
    begun_s = time.perf_counter()
    config, plant = load_machine(machine), load_plant(machine)
    with ThreadPoolExecutor() as threads:
        found = threads.map(lambda name: learn_waveforms(config, plant, name), config.axes)
    axes = dict(zip(config.axes, found, strict=True))
    for name, entry in axes.items():
        WaveformStore(store, config).add(name, entry.learned, {"source": "batch twin"})
    learned = {name: entry.learned for name, entry in axes.items()}
    rivals = rival_figures(config, plant, twin_program(config, study_program(machine)), learned)
    return WaveformStudy({}, axes, rivals, time.perf_counter() - begun_s)


def learning_figures(study: WaveformStudy) -> dict[str, Any]:
    """Return strokes, and J from stroke to stroke at each acceleration, for JSON."""
    return {
        "made": "batch twin",
        "judged": "bus, in lockstep",
        "wall_s": study.wall_s,
        "axes": {
            axis: {
                "strokes": entry.learned.strokes,
                "machine_time_s": entry.learned.machine_time_s,
                "before": 1e6 * entry.learned.before_m,
                "after": 1e6 * entry.learned.after_m,
                "courses": [
                    {"stage": stage, "acceleration_mm_s2": 1e3 * a, "J_um": 1e6 * j}
                    for stage, a, j in entry.course
                ],
            }
            for axis, entry in study.axes.items()
        },
    }
