"""Feed hold and overrides: slow a program down on its path, even to rest, by changing its time law alone.

Path time s advances at the rate r <= 1 of machine time. The axes follow the programmed motion x(s), so by
the chain rule their velocity is x' r and their acceleration x'' r^2 + x' dr/dt. The rate changes as fast as
the acceleration limits allow; while the program itself uses them fully, the rate stays. A force offset
belongs to its position on the path and is not scaled. An override sets the target rate, at most 1, because
the program was planned to the limits; one that was planned to a raised feed runs at 100 % where the rate is
the reciprocal of that. A stop after a step is a hold.
"""

import numpy as np

from kernels.arrays import Array
from servo_ctrl.daemon.set_points.pace import Pace, Stops
from servo_ctrl.daemon.set_points.path_rate import at_rate, standing, steepest_slope_1_s, within_limits
from servo_ctrl.daemon.set_points.reference import ProgramReference, Row, StepSpan, interleave
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.path.path_move import PathMove
from servo_ctrl.motion.profile import Profile, ProgramBlock
from servo_ctrl.motion.program import KIND_OF_STEP, Segment, sample_count

SLOPE_FRACTIONS = (1.0, 0.5, 0.25, 0.0)
"""Fractions of the steepest rate slope tried in a cycle (chosen); zero is always possible."""
DWELL = KIND_OF_STEP[Dwell]
RAISED_KINDS = frozenset({KIND_OF_STEP[Move], KIND_OF_STEP[PathMove]})
"""The kinds of steps whose feed `pace.at_raised_feed` raises."""
ROUNDING = 1e-9
"""Relative tolerance of limits and rates; chosen."""


class FeedHold:
    """Implements `reference.Reference`. `acceleration_m_s2`: limits of the axes.

    Without a hold the rows are the program's samples. After a hold the rows lie between the samples until the
    step ends: a step ends at rest, where rows and samples coincide again.
    """

    def __init__(
        self,
        program: ProgramReference,
        acceleration_m_s2: Array,
        period_s: float,
        stops: Stops | None = None,
        pace: Pace | None = None,
        raised_feed: float = 1.0,
    ) -> None:
        self.program = program
        self._raised_feed = raised_feed
        """The share of its feed to which the program was planned, >= 1."""
        self.holding = False
        """True: come to rest on the path; False: continue along it."""
        self.held_by = ""
        """Why the program holds without a command, else ""."""
        self._stops, self._pace = stops or Stops(), pace or Pace()
        self._last_stop_step = -1
        """The last step after which the program held without a command."""
        self._limits_m_s2 = [limit * (1.0 + ROUNDING) for limit in acceleration_m_s2.tolist()]
        self._period_s = period_s
        self._rate = 1.0
        self._into_period = 0.0
        """Path time since the last row of the program, in periods, 0 <= value < 1."""
        self._row: Row | None = None
        self._programmed_row: Row | None = None
        """The programmed motion at the present path time, kept while the rate is below 1."""
        self._shifted: tuple[Segment, list[Row]] | None = None
        """A segment and its rows, shifted by the present `_into_period`."""

    @property
    def ended(self) -> bool:
        """Whether the last row was returned."""
        return self.program.ended

    @property
    def samples(self) -> int:
        """Number of rows of the program returned so far."""
        return self.program.samples

    @property
    def spans(self) -> list[StepSpan]:
        """The steps begun so far."""
        return self.program.spans

    @property
    def step(self) -> int:
        """Number of the step of the last row, -1 while the rate differs from 1.

        Measurements at another rate do not represent production.
        """
        return self.program.step if self._rate == 1.0 else -1

    @property
    def at_rest(self) -> bool:
        """Whether the program has come to rest on its path."""
        return self._rate == 0.0

    @property
    def block(self) -> ProgramBlock | None:
        """The present block of a part program; None in other steps."""
        segment = self.program.segment
        if segment is None or segment.profile is None or segment.profile.block_at is None:
            return None
        time_s = (self.program.samples_into_step + self._into_period) * self._period_s
        return segment.profile.block_at(min(time_s, segment.profile.duration_s))

    def hold(self, *, hold: bool) -> None:
        """Come to rest on the path, or continue along it."""
        self.holding, self.held_by = hold, ""

    def advance(self, cycle: int) -> Row | None:
        """Return the row of this cycle, None after the last one."""
        row = self._row
        segment = self.program.segment
        profile = segment.profile if segment is not None else None
        if self._stops.any and segment is not None and profile is not None:
            self._hold_after_step(segment.step, profile)
        target = 0.0 if self.holding else self._target_rate(segment)
        unchanged = not self.holding and self._rate == target == 1.0 and not self._into_period
        if unchanged or row is None or segment is None or profile is None:
            row = self.program.advance(cycle)
        elif self.holding and self._rate == 0.0:
            self.program.delay(cycle)
        elif self._rate == target == 1.0:
            row = self._between_samples(profile, cycle)
        elif not self.holding and self._rate == 1.0 and self._is_over(profile):
            row = self.program.advance(cycle)
        else:
            row = self._change_rate(profile, row, cycle, target)
        self._row = row
        return row

    def _target_rate(self, segment: Segment | None) -> float:
        """Return the override that applies to this step; a dwell keeps its duration."""
        pace, raised = self._pace, self._raised_feed
        if pace.feed == pace.rapid == raised == 1.0 or segment is None or segment.kind == DWELL:
            return 1.0
        block = self.block
        if block is not None and block.rapid:
            return pace.rapid
        return min(pace.feed / (raised if segment.kind in RAISED_KINDS else 1.0), 1.0)

    def _is_over(self, profile: Profile) -> bool:
        """Whether all samples of the present step were returned."""
        return not self._into_period and self.program.samples_into_step >= self._count(profile)

    def _hold_after_step(self, step: int, profile: Profile) -> None:
        """Hold at the end of a step if `Stops` requires it."""
        if step == self._last_stop_step or self.holding or not self._is_over(profile):
            return
        if reason := self._stops.reason_after(step):
            self._last_stop_step = step
            self.holding, self.held_by = True, reason

    def _change_rate(self, profile: Profile, row: Row, cycle: int, target: float) -> Row:
        """Return the next row, with the rate as near to `target` as the limits allow."""
        period_s, rate = self._period_s, self._rate
        into_step = self.program.samples_into_step
        programmed = self._programmed_row or self._evaluate(profile, into_step + self._into_period)
        steepest_1_s = steepest_slope_1_s(programmed, rate, target, self._limits_m_s2, period_s)
        for fraction in SLOPE_FRACTIONS:
            following = rate + fraction * steepest_1_s * period_s
            if abs(following - target) < ROUNDING:
                following = target
            time = into_step + self._into_period + 0.5 * (rate + following)
            programmed = self._evaluate(profile, time)
            scaled = at_rate(programmed, following, fraction * steepest_1_s)
            if within_limits(scaled, row, self._limits_m_s2, period_s):
                break
        self._rate, self._programmed_row = following, programmed if following < 1.0 else None
        if time * period_s >= profile.duration_s:
            return self._end_step(profile, row, cycle)
        passed = int(time) - into_step
        for _ in range(passed):
            self.program.advance(cycle)
        self._into_period = time - into_step - passed
        self._shifted = None
        self.program.delay(cycle)
        return scaled if following else standing(scaled)

    def _between_samples(self, profile: Profile, cycle: int) -> Row | None:
        """Return the row at rate 1, shifted from the samples by `_into_period`, which a hold left."""
        segment = self.program.segment
        if segment is None:
            return None
        if self._shifted is None or self._shifted[0] is not segment:
            first = segment.first_sample + 1 + self._into_period
            times = first + np.arange(len(segment.position_m), dtype=np.float64)
            self._shifted = segment, self._motion(profile, times)
        place = self.program.samples_into_step - segment.first_sample
        if place == len(self._shifted[1]):
            self.program.look_ahead(cycle)  # the step continues: its last row falls on a sample
            return self._between_samples(profile, cycle)
        row = self._shifted[1][place]
        self.program.advance(cycle)
        if self.program.samples_into_step >= self._count(profile):
            self._into_period = 0.0
        return row

    def _end_step(self, profile: Profile, row: Row, cycle: int) -> Row:
        """Return the last row of the step, at rest; `row` if the program has returned it already."""
        while self.program.samples_into_step < self._count(profile):
            row = self.program.advance(cycle) or row
        self._into_period, self._rate = 0.0, 0.0 if self.holding else 1.0
        self._programmed_row = self._shifted = None
        return standing(row) if self.holding else row

    def _count(self, profile: Profile) -> int:
        return sample_count(profile.duration_s, self._period_s)

    def _evaluate(self, profile: Profile, periods: float) -> Row:
        """Evaluate the programmed motion at `periods` into the step, at rate 1."""
        return self._motion(profile, np.array([periods]))[0]

    def _motion(self, profile: Profile, periods: Array) -> list[Row]:
        return interleave(profile.at(np.minimum(periods * self._period_s, profile.duration_s)))
