"""What a program's text would do: read by the loader, held against the limits and run through."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.config.dry_run import dry_run
from servo_ctrl.config.errors import ConfigError
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

DRAWN = 4000
"""Points that a browser gets, evenly along the way."""


class Preview(NamedTuple):
    """A program that stays within the limits from home; SI, arrays (points, axes) and (points,)."""

    axes: tuple[str, ...]
    steps: tuple[str, ...]
    duration_s: float
    length_m: float
    lowest_m: tuple[float, ...]
    highest_m: tuple[float, ...]
    top_speed_m_s: float
    position_m: Array
    speed_m_s: Array


def preview_of(machine_file: Path, name: str, text: str) -> Preview:
    """Raises ConfigError, in the loader's words, with the program's name instead of a path."""
    machine = load_machine(machine_file)
    with tempfile.TemporaryDirectory(prefix="servo_ctrl_program_") as directory:
        path = Path(directory) / Path(name).name
        path.write_text(text, encoding="utf-8", errors="replace")
        try:
            program = load_program(path, machine)
            steps = check_program(program, machine)
        except ConfigError as error:
            own = error.file == str(path)
            raise ConfigError(name if own else Path(error.file).name, error.key, error.reason) from None
    found = dry_run(steps, machine)
    position_m, speed_m_s = along_the_way(found.drawn_m, found.drawn_m_s)
    return Preview(
        tuple(machine.axes),
        tuple(step.label for step in steps),
        found.duration_s,
        found.length_m,
        tuple(found.lowest_m.tolist()),
        tuple(found.highest_m.tolist()),
        found.path_speed_m_s,
        position_m,
        speed_m_s,
    )


def along_the_way(position_m: Array, speed_m_s: Array) -> tuple[Array, Array]:
    """Positions (n, axes) and speeds (n,), given by time, at points with equal distances between them."""
    way_m = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(position_m, axis=0), axis=1))))
    points_m = np.linspace(0.0, way_m[-1], min(DRAWN, len(way_m)))
    columns = [np.interp(points_m, way_m, column) for column in position_m.T]
    return np.column_stack(columns), np.interp(points_m, way_m, speed_m_s)
