"""Where the axes are led, cycle by cycle: along a program, down to rest, or where they stand."""

from collections.abc import Iterator, Sequence

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.set_points.reference import Reference, Row, stop_ramp


class SetPointSource:
    """`stop_acceleration_m_s2`: of each axis in a controlled stop."""

    def __init__(self, stop_acceleration_m_s2: Sequence[float], period_s: float) -> None:
        self.program: Reference | None = None
        self.row: Row | None = None
        """Of the last cycle; None: every axis stays where it was taken over."""
        self.segment = -1
        """Number of the step that the row belongs to, -1 outside a program."""
        self._limits, self._period_s = tuple(stop_acceleration_m_s2), period_s
        self._ramp: Iterator[Row] | None = None

    @property
    def stopping(self) -> bool:
        """A controlled stop has begun, and may have come to its end."""
        return self._ramp is not None

    @property
    def at_rest(self) -> bool:
        """The axes are led to where they are."""
        return self.row is None or not any(self.row[1::REFERENCE_FIELDS])

    def set_points_m(self, hold_m: Sequence[float]) -> list[float]:
        """Return where the axes are led; `hold_m`: where they were taken over."""
        return list(hold_m) if self.row is None else self.row[::REFERENCE_FIELDS]

    def follow(self, cycle: int) -> bool:
        """Go on along the program; False when it has given out its last row before."""
        if self.program is None or (row := self.program.advance(cycle)) is None:
            return False
        self.row, self.segment = row, self.program.step
        return True

    def stay(self) -> None:
        """Go on down to rest where a stop has begun, else stay."""
        self.segment = -1
        if self._ramp is not None:
            self.row = next(self._ramp, self.row)

    def ramp_down(self, hold_m: Sequence[float]) -> None:
        """Lead all axes to rest in the same time, from where they are."""
        if self._ramp is None:
            last = self.row
            if last is None:
                last = [value for position_m in hold_m for value in (position_m, 0.0, 0.0, 0.0)]
            self._ramp = stop_ramp(last, self._limits, self._period_s)

    def rest(self) -> None:
        """End the stop."""
        self._ramp = None

    def let_go(self) -> None:
        """Forget everything: the axes are not led any more, or are to be taken over anew."""
        self.program = self._ramp = self.row = None
