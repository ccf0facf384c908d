"""Where the set points of a cycle come from: a program, or the ramp of a controlled stop.

A row is one flat list, `REFERENCE_FIELDS` values an axis, so that the cycle does no array work.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.motion.profile import Motion
from servo_ctrl.motion.program import Segment

Row = list[float]
CHUNK_SAMPLES = 256
"""Samples that a program computes at a time: about 0.1 ms of work every 256 cycles, and little memory."""


class StepSpan(NamedTuple):
    """A step as it was run: cycles [first, last], and those at constant speed, [0, -1] without any.

    Its fields are the entry in recording.json.
    """

    step: int
    label: str
    kind: str
    first_cycle: int
    last_cycle: int
    steady_first_cycle: int = 0
    steady_last_cycle: int = -1


class Reference(Protocol):
    """What a running machine takes its set points from."""

    @property
    def ended(self) -> bool:
        """The last row was given out."""

    @property
    def spans(self) -> list[StepSpan]:
        """The steps that were begun."""

    @property
    def step(self) -> int:
        """Number of the step that the last row belongs to, -1 where it is none of production."""

    def advance(self, cycle: int) -> Row | None:
        """Return the row of this cycle, None after the last one."""


class ProgramReference:
    """The rows of a program, one `advance` a cycle, and the spans of the steps that were run.

    Its steps are numbered from `first_step` on, for a recording may hold several programs.
    """

    def __init__(self, program: Iterable[Segment], first_step: int = 0) -> None:
        self._segments = iter(program)
        self._first_step = first_step
        self._rows: list[Row] = []
        self._given = 0
        """Rows of the present segment."""
        self.segment: Segment | None = None
        self.spans: list[StepSpan] = []
        self.ended = False
        self.samples = 0
        """Rows given out."""
        self.step = -1
        self._delayed = False
        """A feed hold has delayed the present step: it has no constant speed."""

    def advance(self, cycle: int) -> Row | None:
        """Return the row of this cycle, None after the last one."""
        if self._given == len(self._rows) and not self.look_ahead(cycle):
            self.ended = True
            return None
        row = self._rows[self._given]
        self._given += 1
        self.samples += 1
        return row

    def look_ahead(self, cycle: int) -> bool:
        """Open the segment of the next row, if need be; False where there is none."""
        if self._given < len(self._rows):
            return True
        segment = next(self._segments, None)
        if segment is None:
            return False
        self._open(segment, cycle)
        return True

    @property
    def samples_into_step(self) -> int:
        """Rows of the present step that were given out."""
        return self._given + (self.segment.first_sample if self.segment is not None else 0)

    def delay(self, cycle: int) -> None:
        """Move the end of the step, as seen from `cycle`: its rows come later than planned."""
        self._delayed = True
        last = cycle + len(self._rows) - self._given
        self.spans[-1] = self.spans[-1]._replace(last_cycle=last, steady_first_cycle=0, steady_last_cycle=-1)

    def _open(self, segment: Segment, cycle: int) -> None:
        self.segment, self._rows, self._given = segment, interleave(segment), 0
        self.step = self._first_step + segment.step
        last = cycle + len(segment.position_m) - 1
        start, stop = (cycle + row for row in segment.steady)
        steady = (start, stop - 1) if stop > start else (0, -1)
        if segment.first_sample == 0:
            self._delayed = False
            self.spans.append(StepSpan(self.step, segment.label, segment.kind, cycle, last, *steady))
            return
        begun = self.spans[-1]
        if self._delayed:
            steady = (0, -1)
        elif stop > start and begun.steady_last_cycle >= 0:
            steady = begun.steady_first_cycle, steady[1]
        elif stop <= start:
            steady = begun.steady_first_cycle, begun.steady_last_cycle
        self.spans[-1] = begun._replace(
            last_cycle=last, steady_first_cycle=steady[0], steady_last_cycle=steady[1]
        )


def interleave(motion: Segment | Motion) -> list[Row]:
    """Turn arrays (n, axes) into rows, axis by axis."""
    fields = (motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2, motion.force_offset_n)
    rows = np.stack(fields, axis=2).reshape(len(motion.position_m), -1)
    return rows.tolist()


def stop_ramp(last: Row, acceleration_m_s2: Sequence[float], period_s: float) -> Iterator[Row]:
    """Yield rows that bring all axes from `last` to rest, at constant deceleration, in the same time.

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
