"""Feed hold: a program slowed down to rest on its path, and on again. Positions do not know of it, only time.

Path time s runs at the rate r <= 1 of machine time. With x(s) the programmed motion, the axes follow x(s), so
by the chain rule their velocity is x' r and their acceleration x'' r^2 + x' dr/dt. The rate changes as fast
as the acceleration limits allow; where the program itself needs all of them it waits until there is room.
A force offset belongs to the place on the path and stays as it is there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.reference import interleave
from servo_ctrl.motion.program import sample_count

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from servo_ctrl.daemon.reference import ProgramReference, Row, StepSpan
    from servo_ctrl.motion.profile import Motion, Profile
    from servo_ctrl.motion.program import Segment

    Array = NDArray[np.float64]

SHARE = 0.9
"""Of the acceleration limits is planned with; the rest is for what changes within a period."""
TRIALS = (1.0, 0.5, 0.25, 0.0)
"""Parts of the rate's steepest slope that are tried in a cycle; zero is always possible."""
ROUNDING = 1e-9


class FeedHold:
    """A `reference.Reference`. `acceleration_m_s2`: limits of the axes.

    Where a program is not held its rows are passed on as they are. After a hold they lie between the samples
    they would have been, until the step ends; steps end at rest, and there the grid is met again.
    """

    def __init__(self, program: ProgramReference, acceleration_m_s2: Array, period_s: float) -> None:
        self.program = program
        self.held = False
        """Wanted: rest on the path."""
        self._limit_m_s2 = acceleration_m_s2 * (1.0 + ROUNDING)
        self._period_s = period_s
        self._rate = 1.0
        self._beyond = 0.0
        """Periods of path time since the last row that the program gave out, 0 <= beyond < 1."""
        self._row: Row | None = None
        self._shifted: tuple[Segment, list[Row]] | None = None
        """Rows of a segment for the present `_beyond`."""

    @property
    def ended(self) -> bool:
        """The last row was given out."""
        return self.program.ended

    @property
    def samples(self) -> int:
        """Rows of the program that were run."""
        return self.program.samples

    @property
    def spans(self) -> list[StepSpan]:
        """The steps that were begun."""
        return self.program.spans

    @property
    def step(self) -> int:
        """Number of the step that the last row belongs to, -1 without one."""
        return self.program.step

    def hold(self) -> None:
        """To rest on the path."""
        self.held = True

    def resume(self) -> None:
        """On along the path."""
        self.held = False

    @property
    def at_rest(self) -> bool:
        """The hold has come to its end."""
        return self._rate == 0.0

    def advance(self, cycle: int) -> Row | None:
        """The row of this cycle, None after the last one."""
        row = self._row
        segment = self.program.segment
        profile = segment.profile if segment is not None else None
        as_it_is = not self.held and self._rate == 1.0 and not self._beyond
        if as_it_is or row is None or segment is None or profile is None:
            row = self.program.advance(cycle)
        elif self.held and self._rate == 0.0:
            self.program.delay(cycle)
        elif not self.held and self._rate == 1.0:
            row = self._between_samples(profile, cycle)
        else:
            row = self._change_rate(profile, row, cycle)
        self._row = row
        return row

    def _change_rate(self, profile: Profile, row: Row, cycle: int) -> Row:
        """The next row, with the rate as near to what is wanted as the limits allow."""
        period_s, rate, wanted = self._period_s, self._rate, 0.0 if self.held else 1.0
        into_step = self.program.samples_into_step
        before_m_s = np.array(row[1::REFERENCE_FIELDS])
        steepest_1_s = self._steepest(self._motion(profile, into_step + self._beyond), rate, wanted)
        for part in TRIALS:
            following = rate + part * steepest_1_s * period_s
            if abs(following - wanted) < ROUNDING:
                following = wanted
            time = into_step + self._beyond + 0.5 * (rate + following)
            path = self._motion(profile, time)
            velocity_m_s = path.velocity_m_s * following
            acceleration_m_s2 = (
                path.acceleration_m_s2 * following**2 + path.velocity_m_s * part * steepest_1_s
            )
            change_m_s2 = (velocity_m_s - before_m_s) / period_s
            needed_m_s2 = np.maximum(np.abs(acceleration_m_s2), np.abs(change_m_s2))
            if (needed_m_s2 <= self._limit_m_s2).all():
                break
        self._rate = following
        if time * period_s >= profile.duration_s:
            return self._end_step(profile, row, cycle)
        passed = int(time) - into_step
        for _ in range(passed):
            self.program.advance(cycle)
        self._beyond = time - into_step - passed
        self._shifted = None
        self.program.delay(cycle)
        moving = path._replace(velocity_m_s=velocity_m_s, acceleration_m_s2=acceleration_m_s2)
        following_row = interleave(moving)[0]
        return following_row if following else _resting(following_row)

    def _steepest(self, path: Motion, rate: float, wanted: float) -> float:
        """dr/dt towards the wanted rate, with |x'' r^2 + x' dr/dt| within the limits for every axis."""
        needed = path.acceleration_m_s2[0] * rate**2
        room = np.maximum(SHARE * self._limit_m_s2, np.abs(needed))
        towards = 1.0 if wanted > rate else -1.0
        # the bound lies where x' dr/dt has the sign of x' towards
        speed = path.velocity_m_s[0] * towards
        moving = speed != 0.0
        free = (room - needed * np.sign(speed))[moving] / np.abs(speed[moving])
        largest = abs(wanted - rate) / self._period_s
        return towards * float(min(free.min(initial=np.inf), largest))

    def _between_samples(self, profile: Profile, cycle: int) -> Row | None:
        """At rate 1, beside the samples by as much as the hold has left over."""
        segment = self.program.segment
        if segment is None:
            return None
        if self._shifted is None or self._shifted[0] is not segment:
            first = segment.first_sample + 1 + self._beyond
            times = first + np.arange(len(segment.position_m), dtype=np.float64)
            self._shifted = segment, interleave(self._motion(profile, times))
        place = self.program.samples_into_step - segment.first_sample
        if place == len(self._shifted[1]):
            self.program.look_ahead(cycle)  # the step goes on: its last row has no time left over
            return self._between_samples(profile, cycle)
        row = self._shifted[1][place]
        self.program.advance(cycle)
        if self.program.samples_into_step >= self._count(profile):
            self._beyond = 0.0
        return row

    def _end_step(self, profile: Profile, row: Row, cycle: int) -> Row:
        """The last row of the step, where the axes rest; `row` where it was given out already."""
        while self.program.samples_into_step < self._count(profile):
            row = self.program.advance(cycle) or row
        self._beyond, self._rate, self._shifted = 0.0, 0.0 if self.held else 1.0, None
        return _resting(row) if self.held else row

    def _count(self, profile: Profile) -> int:
        return sample_count(profile.duration_s, self._period_s)

    def _motion(self, profile: Profile, periods: float | Array) -> Motion:
        """The programmed motion so many periods into the step, at rate 1."""
        time_s = np.atleast_1d(np.asarray(periods, dtype=np.float64)) * self._period_s
        return profile.at(np.minimum(time_s, profile.duration_s))


def _resting(row: Row) -> Row:
    """A row without velocity and acceleration."""
    rest = row.copy()
    rest[1::REFERENCE_FIELDS] = rest[2::REFERENCE_FIELDS] = [0.0] * (len(row) // REFERENCE_FIELDS)
    return rest
