"""Checks the text of a program: read by the loader, held against the limits, and simulated from home."""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.config.dry_run import dry_run
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program
from servo_ctrl.errors import ConfigError

MAX_POINTS = 4000
"""Points of the path that a browser gets: more than a screen has pixels across."""


class Preview(NamedTuple):
    """What a program does that stays within the limits from home; SI."""

    axes: tuple[str, ...]
    steps: tuple[str, ...]
    duration_s: float
    length_m: float
    lowest_m: tuple[float, ...]
    highest_m: tuple[float, ...]
    top_speed_m_s: float
    position_m: Array
    """(points, axes)."""
    speed_m_s: Array
    """(points,)."""


def preview_of(machine_file: Path, name: str, text: str) -> Preview:
    """Check a program and return its path. Raises the ConfigError of the loader, with the program's name."""
    machine = load_machine(machine_file)
    with tempfile.TemporaryDirectory(prefix="servo_ctrl_program_") as directory:
        path = Path(directory) / Path(name).name
        path.write_text(text, encoding="utf-8", errors="replace")
        try:
            program = load_program(path, machine)
            steps = check_program(program, machine)
        except ConfigError as error:
            file = name if error.file == str(path) else Path(error.file).name
            raise ConfigError(file, error.key, error.reason) from None
    run = dry_run(steps, machine)
    position_m, speed_m_s = equidistant(run.drawn_m, run.drawn_m_s)
    return Preview(
        axes=tuple(machine.axes),
        steps=tuple(step.label for step in steps),
        duration_s=run.duration_s,
        length_m=run.length_m,
        lowest_m=tuple(run.lowest_m.tolist()),
        highest_m=tuple(run.highest_m.tolist()),
        top_speed_m_s=run.path_speed_m_s,
        position_m=position_m,
        speed_m_s=speed_m_s,
    )


def equidistant(position_m: Array, speed_m_s: Array) -> tuple[Array, Array]:
    """Resample positions (n, axes) and speeds (n,) from equal times to equal distances along the path."""
    step_m = np.linalg.norm(np.diff(position_m, axis=0), axis=1)
    distance_m = np.concatenate(([0.0], np.cumsum(step_m)))
    points_m = np.linspace(0.0, distance_m[-1], min(MAX_POINTS, len(distance_m)))
    columns = [np.interp(points_m, distance_m, column) for column in position_m.T]
    return np.column_stack(columns), np.interp(points_m, distance_m, speed_m_s)
