"""Selects the set points of each cycle: those of a program, of a stop ramp, or a constant position."""

from collections.abc import Iterator, Sequence

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.set_points.reference import Reference, Row, stop_ramp
from servo_ctrl.motion.input_shaper import RowShaper, Taps


class SetPointSource:
    """`stop_acceleration_m_s2`: deceleration of each axis in a controlled stop."""

    def __init__(self, stop_acceleration_m_s2: Sequence[float], period_s: float) -> None:
        self.program: Reference | None = None
        self.row: Row | None = None
        """Set points of the last cycle, shaped; None: every axis holds where it was taken over."""
        self.segment = -1
        """Number of the step of `row`, -1 outside a program."""
        self._limits, self._period_s = tuple(stop_acceleration_m_s2), period_s
        self._ramp: Iterator[Row] | None = None
        self._unshaped: Row | None = None
        """The row before shaping."""
        self._shaper = RowShaper((), REFERENCE_FIELDS)

    def shape(self, shapers: Sequence[Taps | None]) -> None:
        """Shape the set points of each axis from now on; the axes are at rest."""
        self._shaper = RowShaper(shapers, REFERENCE_FIELDS)

    @property
    def stopping(self) -> bool:
        """Whether a controlled stop has begun; it may have ended already."""
        return self._ramp is not None

    @property
    def at_rest(self) -> bool:
        """Whether the set points are at rest, before and after the shaper."""
        row = self._unshaped
        return row is None or (not any(row[1::REFERENCE_FIELDS]) and self._shaper.over)

    def set_points_m(self, hold_m: Sequence[float]) -> list[float]:
        """Return the position set points, metres by axis; `hold_m`: where the axes were taken over."""
        return list(hold_m) if self._unshaped is None else self._unshaped[::REFERENCE_FIELDS]

    def begin(self, program: Reference, hold_m: Sequence[float]) -> None:
        """Follow a program from rest; `hold_m`: where the axes were taken over."""
        self.program = program
        if self._unshaped is None:
            self._shaper.rest_at([value for at_m in hold_m for value in (at_m, 0.0, 0.0, 0.0)])

    def follow(self, cycle: int) -> bool:
        """Take the next row of the program; return False after its last row."""
        if self.program is None or (row := self.program.advance(cycle)) is None:
            return False
        self.segment = self.program.step
        self._set_row(row)
        return True

    def hold_or_ramp(self) -> None:
        """Take the next row of a stop ramp, if one has begun; else keep the row."""
        self.segment = -1
        row = self._unshaped if self._ramp is None else next(self._ramp, self._unshaped)
        if row is not None and (row is not self._unshaped or not self._shaper.over):
            self._set_row(row)

    def _set_row(self, row: Row) -> None:
        self._unshaped, self.row = row, self._shaper.shape(row)

    def ramp_down(self, hold_m: Sequence[float]) -> None:
        """Begin a stop ramp that brings all axes to rest in the same time."""
        if self._ramp is None:
            last = self._unshaped
            if last is None:
                last = [value for position_m in hold_m for value in (position_m, 0.0, 0.0, 0.0)]
            self._ramp = stop_ramp(last, self._limits, self._period_s)

    def end_ramp(self) -> None:
        """End the controlled stop."""
        self._ramp = None

    def reset(self) -> None:
        """Drop program and set points: the axes lose control or are taken over again."""
        self.program = self._ramp = self.row = self._unshaped = None
        self._shaper.forget()
