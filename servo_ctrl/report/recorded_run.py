"""Reads a recording for the report: arrays of each axis, steps of the program, reversals."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import RecordingError
from servo_ctrl.recording.reversal_log import REVERSALS_FILE, read_reversals
from servo_ctrl.report.header import RecordedStep, RecordingHeader, checked_header


class RecordedAxis(NamedTuple):
    """The columns of one axis, (n,) each; NaN where the axis was not controlled or an input is missing."""

    name: str
    command_m: Array
    table_m: Array
    """Position of the scale, or of the motor if there is no scale."""
    has_scale: bool
    following_m: Array
    """Set point minus feedback of the position loop."""
    force_n: Array
    current_a: Array

    @property
    def error_m(self) -> Array:
        """Command minus table position."""
        return self.command_m - self.table_m


class RecordedRun(NamedTuple):
    """A recording with everything that a report needs."""

    directory: Path
    header: RecordingHeader
    time_s: Array
    cycle: NDArray[np.int64]
    segment: NDArray[np.int64]
    axes: tuple[RecordedAxis, ...]
    reversals: tuple[dict[str, Any], ...] | None
    """The reversals evaluated by the run; None without a log."""

    @property
    def in_program(self) -> NDArray[np.bool_]:
        """Whether a row belongs to a step of the program, (n,)."""
        return self.segment >= 0

    def steps(self) -> list[tuple[int, RecordedStep, slice]]:
        """Return index, step and rows of each executed step, in order."""
        ends = np.flatnonzero(np.diff(self.segment, append=-2)) + 1
        starts = np.concatenate(([0], ends[:-1]))
        found = zip(starts.tolist(), ends.tolist(), strict=True)
        steps = self.header.segments
        return [
            (index, steps[index], slice(start, end))
            for start, end in found
            if 0 <= (index := int(self.segment[start])) < len(steps)
        ]


def read_run(directory: Path) -> RecordedRun:
    """Read and check a recording. Raises RecordingError with reason and remedy."""
    recording = load_recording(directory)
    header = checked_header(directory, recording.header)
    columns = recording.columns
    missing = [channel.name for channel in channels_of(header.axes) if channel.name not in columns]
    if missing:
        raise RecordingError(f"{directory}: the recording has no column {', '.join(missing[:3])}")
    if not len(columns["time_s"]):
        raise RecordingError(f"{directory}: the recording is empty: it was ended before its first cycle")
    run = RecordedRun(
        directory=directory,
        header=header,
        time_s=np.asarray(columns["time_s"], dtype=np.float64),
        cycle=np.asarray(columns["cycle"], dtype=np.int64),
        segment=np.asarray(columns["segment"], dtype=np.int64),
        axes=tuple(_axis(name, columns) for name in header.axes),
        reversals=_reversals(directory),
    )
    if not any(np.isfinite(axis.error_m).any() for axis in run.axes):
        raise RecordingError(
            f"{directory}: nothing to report on: no axis was controlled and measured in any of the "
            f"{len(run.time_s)} rows; the run ended before its program"
            + (f" ({header.reason})" if header.reason else "")
        )
    return run


def _axis(name: str, columns: dict[str, NDArray[Any]]) -> RecordedAxis:
    scale_m = columns[f"{name}.scale_position_m"]
    has_scale = bool(np.isfinite(scale_m).any())
    return RecordedAxis(
        name=name,
        command_m=columns[f"{name}.position_command_m"],
        table_m=scale_m if has_scale else columns[f"{name}.motor_position_m"],
        has_scale=has_scale,
        following_m=columns[f"{name}.position_error_m"],
        force_n=columns[f"{name}.force_command_n"],
        current_a=columns[f"{name}.motor_current_a"],
    )


def _reversals(directory: Path) -> tuple[dict[str, Any], ...] | None:
    if not (directory / REVERSALS_FILE).exists():
        return None
    entries = read_reversals(directory)
    for number, entry in enumerate(entries, start=1):
        numbers = [entry.get(key) for key in ("time_s", "acceleration_m_s2", *INDICATORS)]
        if not isinstance(entry.get("axis"), str) or not all(isinstance(one, float | int) for one in numbers):
            raise RecordingError(f"{directory / REVERSALS_FILE}: line {number} is not a reversal")
    return tuple(entries)


INDICATORS = ("contour_peak_m", "error_peak_m", "error_rms_m", "error_mean_m")
