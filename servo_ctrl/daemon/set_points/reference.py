"""Generates the set points of each cycle: from a program, or for the ramp of a controlled stop.

A row is a flat list of `REFERENCE_FIELDS` values for each axis, so that the cycle handles no arrays.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.motion.profile import Motion
from servo_ctrl.motion.program import Segment

Row = list[float]
CHUNK_SAMPLES = 256
"""Samples that a program computes at once: about 0.1 ms of work every 256 cycles, and little memory."""


class StepSpan(NamedTuple):
    """An executed step: its cycles [first, last], and those at constant speed, [0, -1] without any.

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
    """Supplies the set points of a running machine."""

    @property
    def ended(self) -> bool:
        """Whether the last row was returned."""

    @property
    def spans(self) -> list[StepSpan]:
        """The steps begun so far."""

    @property
    def step(self) -> int:
        """Number of the step of the last row, -1 if the row does not represent production."""

    def advance(self, cycle: int) -> Row | None:
        """Return the row of this cycle, None after the last one."""


class ProgramReference:
    """Returns the rows of a program, one `advance` a cycle, and keeps the spans of its steps.

    Step numbers begin at `first_step`, because a recording may hold several programs.
    """

    def __init__(self, program: Iterable[Segment], first_step: int = 0) -> None:
        self._segments = iter(program)
        self._first_step = first_step
        self._rows: list[Row] = []
        self._returned = 0
        """Rows of the present segment returned so far."""
        self.segment: Segment | None = None
        self.spans: list[StepSpan] = []
        self.ended = False
        self.samples = 0
        """Rows returned so far."""
        self.step = -1
        self._delayed = False
        """Whether a feed hold has delayed the present step, which then has no constant speed."""

    def advance(self, cycle: int) -> Row | None:
        """Return the row of this cycle, None after the last one."""
        if self._returned == len(self._rows) and not self.look_ahead(cycle):
            self.ended = True
            return None
        row = self._rows[self._returned]
        self._returned += 1
        self.samples += 1
        return row

    def look_ahead(self, cycle: int) -> bool:
        """Open the segment of the next row if needed; return False after the last segment."""
        if self._returned < len(self._rows):
            return True
        segment = next(self._segments, None)
        if segment is None:
            return False
        self._open(segment, cycle)
        return True

    @property
    def samples_into_step(self) -> int:
        """Rows of the present step returned so far."""
        return self._returned + (self.segment.first_sample if self.segment is not None else 0)

    def delay(self, cycle: int) -> None:
        """Postpone the end of the step as of `cycle`, because its rows are returned later than planned."""
        self._delayed = True
        last = cycle + len(self._rows) - self._returned
        self.spans[-1] = self.spans[-1]._replace(last_cycle=last, steady_first_cycle=0, steady_last_cycle=-1)

    def _open(self, segment: Segment, cycle: int) -> None:
        self.segment, self._rows, self._returned = segment, interleave(segment), 0
        self.step = self._first_step + segment.step
        last = cycle + len(segment.position_m) - 1
        start, stop = (cycle + row for row in segment.steady)
        steady = (start, stop - 1) if stop > start else (0, -1)
        if segment.first_sample == 0:
            self._delayed = False
            self.spans.append(
                StepSpan(
                    step=self.step,
                    label=segment.label,
                    kind=segment.kind,
                    first_cycle=cycle,
                    last_cycle=last,
                    steady_first_cycle=steady[0],
                    steady_last_cycle=steady[1],
                )
            )
            return
        span = self.spans[-1]
        if self._delayed:
            steady = (0, -1)
        elif stop > start and span.steady_last_cycle >= 0:
            steady = span.steady_first_cycle, steady[1]
        elif stop <= start:
            steady = span.steady_first_cycle, span.steady_last_cycle
        self.spans[-1] = span._replace(
            last_cycle=last, steady_first_cycle=steady[0], steady_last_cycle=steady[1]
        )


def interleave(motion: Segment | Motion) -> list[Row]:
    """Interleave arrays (n, axes) into n rows, axis by axis."""
    fields = (motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2, motion.force_offset_n)
    rows = np.stack(fields, axis=2).reshape(len(motion.position_m), -1)
    return rows.tolist()


def stop_ramp(last: Row, acceleration_m_s2: Sequence[float], period_s: float) -> Iterator[Row]:
    """Yield rows that bring all axes from `last` to rest at constant deceleration in the same time.

    The axis that needs longest at its limit `acceleration_m_s2` sets that time; a force offset ends at once.
    There is always a last row, at rest.
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
