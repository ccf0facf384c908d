"""Measures the distance of the table from the contour of a part program, at feed (G1, G2, G3).

One distance is to the programmed geometry and includes corner rounding, another to the commanded path and
shows the servo alone. Distances are to the nearest point, not to the point of the same time, because a lag
along the path is not a contour error.
"""

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, rms
from servo_ctrl.config.kernel_params import motion_limits
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import reason_of
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.motion.path.path_move import PathMove, plan_path, true_geometry
from servo_ctrl.motion.program import Step
from servo_ctrl.recording.reader import Recording
from servo_ctrl.recording.recorder import RecordingError

CONTOUR_FILE = "contour_error.json"
LAG_S = 0.1
"""Seconds of the commanded path before and after a sample that contain the nearest point; chosen."""


class Figures(NamedTuple):
    """Distances of one kind, metres, and the program line with the largest one."""

    rms_m: float
    p99_m: float
    largest_m: float
    line: int

    def as_json(self) -> dict[str, Any]:
        """Return the figures in micrometres."""
        return {
            "rms_um": self.rms_m * 1e6,
            "p99_um": self.p99_m * 1e6,
            "max_um": self.largest_m * 1e6,
            "line": self.line,
        }


class ContourError(NamedTuple):
    """Contour error over all samples at feed."""

    to_program: Figures
    """Distance of the table to the programmed geometry."""
    to_command: Figures
    """Distance of the table to the commanded path."""
    rounding: Figures
    """Distance of the commanded path to the geometry: only the rounding of corners."""
    samples: int


class _Distances(NamedTuple):
    """Distances of the samples of one path at feed, (n,) each."""

    to_program_m: Array
    to_command_m: Array
    rounding_m: Array
    line: NDArray[np.int64]


def contour_error(recording: Recording, steps: Sequence[Step], machine: MachineConfig) -> ContourError | None:
    """Return the contour error of the first run of `steps` in a recording; None without motion at feed.

    The first path is the approach from the initial position, and no contour.
    """
    paths = [(index, step) for index, step in enumerate(steps) if isinstance(step, PathMove)]
    distances = [_distances(recording, index, step, machine) for index, step in paths[1:]]
    joined = (
        _Distances(*(np.concatenate(parts) for parts in zip(*distances, strict=True))) if distances else None
    )
    if joined is None or not len(joined.line):
        return None
    return ContourError(
        to_program=_figures(joined.to_program_m, joined.line),
        to_command=_figures(joined.to_command_m, joined.line),
        rounding=_figures(joined.rounding_m, joined.line),
        samples=len(joined.line),
    )


def write_contour_error(recording: Recording, contour: ContourError) -> None:
    """Write the figures beside the recording. Raises RecordingError."""
    values = {"samples_at_feed": contour.samples} | {
        name: figures.as_json() for name, figures in contour._asdict().items() if isinstance(figures, Figures)
    }
    path = recording.directory / CONTOUR_FILE
    try:
        write_text_whole(path, json.dumps(values, indent=2) + "\n")
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written: {reason_of(error)}") from None


def distance_to_path(points_m: Array, path_m: Array, window: int) -> Array:
    """Return the distance of point i to the pieces i - window .. i + window of the polyline `path_m`.

    Both arrays are (n, axes) with about as many points, at least two.
    """
    nearest_m2 = np.full(len(points_m), np.inf)
    piece_m = np.diff(path_m, axis=0)
    length_m2 = np.maximum(np.sum(piece_m**2, axis=1), np.finfo(np.float64).tiny)
    pieces = len(piece_m)
    for shift in range(-window, window + 1):
        rows = slice(max(0, -shift), max(min(len(points_m), pieces - shift), 0))
        part = slice(max(0, shift), max(min(pieces, len(points_m) + shift), 0))
        offset_m = points_m[rows] - path_m[:-1][part]
        along = np.clip(np.sum(offset_m * piece_m[part], axis=1) / length_m2[part], 0.0, 1.0)
        offset_m -= along[:, np.newaxis] * piece_m[part]
        nearest_m2[rows] = np.minimum(nearest_m2[rows], np.sum(offset_m**2, axis=1))
    return np.asarray(np.sqrt(nearest_m2))


def _distances(recording: Recording, index: int, step: PathMove, machine: MachineConfig) -> _Distances:
    command_m, table_m = _positions(recording)
    of_step = np.flatnonzero(recording.columns["segment"] == index)
    rows = of_step[np.flatnonzero(np.isfinite(table_m[of_step] + command_m[of_step]).all(axis=1))]
    if not len(rows):
        nothing = np.zeros(0)
        return _Distances(nothing, nothing, nothing, np.zeros(0, dtype=np.int64))
    period_s = machine.period_s
    before_m = command_m[max(of_step[0] - 1, 0)]
    start_m = np.where(np.isfinite(before_m), before_m, command_m[rows[0]])
    nearest = true_geometry(step, start_m)
    path_m, window = np.concatenate((start_m[np.newaxis], command_m[rows])), round(LAG_S / period_s)
    # two elements may share a point, so the time determines the present element
    time_s = (recording.columns["cycle"][rows] - recording.columns["cycle"][of_step[0]] + 1.0) * period_s
    element = plan_path(step, start_m, motion_limits(machine), period_s).element_at(time_s)
    feed_m_s = np.array([entry.feed_m_s for entry in step.elements])
    at_feed = np.isfinite(feed_m_s[element])
    return _Distances(
        to_program_m=nearest(table_m[rows])[0][at_feed],
        to_command_m=distance_to_path(table_m[rows], path_m, window)[at_feed],
        rounding_m=nearest(command_m[rows])[0][at_feed],
        line=np.array([entry.line for entry in step.elements], dtype=np.int64)[element[at_feed]],
    )


def _positions(recording: Recording) -> tuple[Array, Array]:
    """Return command and measured position (N, axes): of the scale if there is one, else of the motor."""
    columns = recording.columns
    command, table = [], []
    for axis in recording.axes:
        scale_m, motor_m = columns[f"{axis}.scale_position_m"], columns[f"{axis}.motor_position_m"]
        table.append(scale_m if np.isfinite(scale_m).any() else motor_m)
        command.append(columns[f"{axis}.position_command_m"])
    return np.column_stack(command), np.column_stack(table)


def _figures(distance_m: Array, line: NDArray[np.int64]) -> Figures:
    worst = int(np.argmax(distance_m))
    return Figures(
        rms_m=rms(distance_m),
        p99_m=float(np.percentile(distance_m, 99.0)),
        largest_m=float(distance_m[worst]),
        line=int(line[worst]),
    )
