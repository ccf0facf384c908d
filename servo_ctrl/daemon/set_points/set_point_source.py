"""Selects the set points of each cycle: those of a program, of a stop ramp, or a constant position."""

from collections.abc import Iterator, Sequence

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.set_points.reference import Reference, Row, stop_ramp


class SetPointSource:
    """`stop_acceleration_m_s2`: deceleration of each axis in a controlled stop."""

    def __init__(self, stop_acceleration_m_s2: Sequence[float], period_s: float) -> None:
        self.program: Reference | None = None
        self.row: Row | None = None
        """Set points of the last cycle; None: every axis holds where it was taken over."""
        self.segment = -1
        """Number of the step of `row`, -1 outside a program."""
        self._limits, self._period_s = tuple(stop_acceleration_m_s2), period_s
        self._ramp: Iterator[Row] | None = None

    @property
    def stopping(self) -> bool:
        """Whether a controlled stop has begun; it may have ended already."""
        return self._ramp is not None

    @property
    def at_rest(self) -> bool:
        """Whether the set points are at rest."""
        return self.row is None or not any(self.row[1::REFERENCE_FIELDS])

    def set_points_m(self, hold_m: Sequence[float]) -> list[float]:
        """Return the position set points, metres by axis; `hold_m`: where the axes were taken over."""
        return list(hold_m) if self.row is None else self.row[::REFERENCE_FIELDS]

    def follow(self, cycle: int) -> bool:
        """Take the next row of the program; return False after its last row."""
        if self.program is None or (row := self.program.advance(cycle)) is None:
            return False
        self.row, self.segment = row, self.program.step
        return True

    def stay(self) -> None:
        """Take the next row of a stop ramp, if one has begun; else keep the row."""
        self.segment = -1
        if self._ramp is not None:
            self.row = next(self._ramp, self.row)

    def ramp_down(self, hold_m: Sequence[float]) -> None:
        """Begin a stop ramp that brings all axes to rest in the same time."""
        if self._ramp is None:
            last = self.row
            if last is None:
                last = [value for position_m in hold_m for value in (position_m, 0.0, 0.0, 0.0)]
            self._ramp = stop_ramp(last, self._limits, self._period_s)

    def rest(self) -> None:
        """End the controlled stop."""
        self._ramp = None

    def let_go(self) -> None:
        """Forget program and set points: the axes lose control or are taken over anew."""
        self.program = self._ramp = self.row = None
