"""Learned functions and strokes to store, and X-Y tables to store them for."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from machine_files import XY_TABLE, text_of, write_controller

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.learning.stroke_result import ERROR_RESOLUTION_M
from servo_ctrl.learning.types import Learned, Pulse, Stroke, StrokeResult

LEARNED = Learned(
    learner="fast",
    durations=((0.002, 0.31), (0.008, 0.19), (0.03, 0.1), (0.12, 0.1 / 3.0)),
    amplitudes=((0.002, 0.0004), (0.008, 0.0006), (0.03, 0.0011), (0.12, 0.0017)),
    spread_m_s2=0.005,
    trailing=((0.002, 0.2, 0.05, -1e-4), (0.12, 0.03, 0.02, -4e-4)),
    before_m=5.25e-6,
    after_m=1.125e-6,
    strokes=61,
    machine_time_s=412.5,
)

SHORT_STROKES = Learned(
    learner="fast",
    durations=((0.06, 0.050), (0.11, 0.037), (0.2, 0.029)),
    amplitudes=((0.06, 0.0010), (0.11, 0.00147), (0.2, 0.0020)),
    spread_m_s2=0.0,
    trailing=(),
    before_m=7.2e-6,
    after_m=3.1e-6,
    strokes=35,
    machine_time_s=74.4,
)
"""Result of learning axis x in short strokes of R = 10 mm; axis y differs little."""


def table_in(directory: Path, *changes: tuple[str, str]) -> MachineConfig:
    """Copy the X-Y table into a directory, with A_max 2 mm/s and texts replaced (old, new); load it."""
    text = text_of(XY_TABLE / "controller.toml")
    text = re.sub(r"rise_ms = [0-9.]+", "rise_ms = 10.0", text)
    text = re.sub(r"acceleration_allowed_mm_s2 = [0-9.]+", "acceleration_allowed_mm_s2 = 200.0", text)
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return load_machine(write_controller(directory, text))


def content_of(learned: Learned) -> dict[str, Any]:
    """Return the content of a result file, written independently of the store."""
    points = {
        "durations": [{"acceleration_m_s2": a, "duration_s": t} for a, t in learned.durations],
        "amplitudes": [{"acceleration_m_s2": a, "amplitude_m_s": v} for a, v in learned.amplitudes],
        "trailing": [
            {"acceleration_m_s2": a, "start_s": start, "duration_s": t, "amplitude_m_s": v}
            for a, start, t, v in learned.trailing
        ],
    }
    return {
        "format": 1,
        "version": 1,
        "machine": "xy_table",
        "axis": "x",
        "learned_at": "2026-11-21T10:30:00Z",
        "software": "0.1.0",
        "basis": {},
        "conditions": {},
        "learned": learned._asdict() | points,
    }


def copy_of(version: int, source: Path, target: Path) -> Path:
    """Copy a version file to another directory under the same name; return the copy."""
    target.mkdir(parents=True, exist_ok=True)
    return Path(shutil.copy(source / f"v{version:04d}.json", target))


def stroke_of(number: int, samples: int = 40) -> tuple[Stroke, StrokeResult]:
    """Return a stroke that differs from all others, with errors in whole nanometres."""
    random = np.random.default_rng(number)
    pulse = Pulse(*(float(value) for value in random.uniform(0.0, 2e-3, 5)))
    stroke = Stroke("coarse", float(random.uniform(0.002, 0.12)), pulse)
    error_m = np.round(random.normal(0.0, 3e-6, (2, samples)) / ERROR_RESOLUTION_M) * ERROR_RESOLUTION_M
    return stroke, StrokeResult(error_m, 1e-3)
