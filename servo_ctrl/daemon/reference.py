"""Where the set points of a cycle come from: a program, or the ramp of a controlled stop.

A row is one flat list, `REFERENCE_FIELDS` values an axis, so that the cycle does no array work.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from servo_ctrl.axis.servo import REFERENCE_FIELDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from servo_ctrl.motion.program import Segment

Row = list[float]
CHUNK_SAMPLES = 256
"""Samples that a program computes at a time: about 0.1 ms of work every 256 cycles, and little memory."""


class ProgramRow(NamedTuple):
    """One sample of a program: the step it belongs to, its index in the step, and the row."""

    step: int
    sample: int
    row: Row


class StepSpan(NamedTuple):
    """A step as it was run: cycles [first, last], and those at constant speed, [0, -1] without any."""

    step: int
    label: str
    kind: str
    first_cycle: int
    last_cycle: int
    steady_first_cycle: int = 0
    steady_last_cycle: int = -1

    def as_header(self) -> dict[str, Any]:
        """The entry in recording.json."""
        return self._asdict()


class ProgramReference:
    """The rows of a program, one `advance` a cycle, and the spans of the steps that were run.

    Its steps are numbered from `first_step` on, for a recording may hold several programs.
    """

    def __init__(self, program: Iterable[Segment], first_step: int = 0) -> None:
        self._segments = iter(program)
        self._first_step = first_step
        self._rows: Iterator[Row] = iter(())
        self.spans: list[StepSpan] = []
        self.ended = False
        """The last row was given out."""
        self.step = -1
        """Number of the step that the last row belongs to."""

    def advance(self, cycle: int) -> Row | None:
        """The row of this cycle, None after the last one."""
        row = next(self._rows, None)
        if row is None:
            segment = next(self._segments, None)
            if segment is None:
                self.ended = True
                return None
            self._open(segment, cycle)
            row = next(self._rows)
        return row

    def _open(self, segment: Segment, cycle: int) -> None:
        self._rows = iter(interleave(segment))
        self.step = self._first_step + segment.step
        last = cycle + len(segment.position_m) - 1
        start, stop = (cycle + row for row in segment.steady)
        steady = (start, stop - 1) if stop > start else (0, -1)
        if segment.first_sample == 0:
            self.spans.append(StepSpan(self.step, segment.label, segment.kind, cycle, last, *steady))
            return
        begun = self.spans[-1]
        if stop > start and begun.steady_last_cycle >= 0:
            steady = begun.steady_first_cycle, steady[1]
        elif stop <= start:
            steady = begun.steady_first_cycle, begun.steady_last_cycle
        self.spans[-1] = begun._replace(
            last_cycle=last, steady_first_cycle=steady[0], steady_last_cycle=steady[1]
        )


def interleave(segment: Segment) -> list[Row]:
    """A segment's arrays (n, axes) as rows, axis by axis."""
    fields = (segment.position_m, segment.velocity_m_s, segment.acceleration_m_s2, segment.force_offset_n)
    rows = np.stack(fields, axis=2).reshape(len(segment.position_m), -1)
    return rows.tolist()


def stop_ramp(last: Row, acceleration_m_s2: Sequence[float], period_s: float) -> Iterator[Row]:
    """Rows that bring all axes from `last` to rest, at constant deceleration, in the same time.

    That time is the one the slowest axis needs with its limit (per axis, m/s^2); a force offset ends
    at once. Never empty: the last row is at rest.
    """
    axes = range(len(acceleration_m_s2))
    start_m = [last[REFERENCE_FIELDS * axis] for axis in axes]
    speed_m_s = [last[REFERENCE_FIELDS * axis + 1] for axis in axes]
    duration_s = max(abs(speed_m_s[axis]) / acceleration_m_s2[axis] for axis in axes)
    count = int(np.ceil(duration_s / period_s - 1e-9))
    for i in range(1, count):
        t_s = i * period_s
        left = 1.0 - t_s / duration_s
        row: Row = []
        for x_m, v_m_s in zip(start_m, speed_m_s, strict=True):
            row += [x_m + v_m_s * t_s * 0.5 * (1.0 + left), v_m_s * left, -v_m_s / duration_s, 0.0]
        yield row
    row = []
    for x_m, v_m_s in zip(start_m, speed_m_s, strict=True):
        row += [x_m + 0.5 * v_m_s * duration_s, 0.0, 0.0, 0.0]
    yield row
