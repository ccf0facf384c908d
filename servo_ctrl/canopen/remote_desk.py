"""The desk of a controller elsewhere, asked by SDO: the counterpart of `desk_objects`, for the command line.

Blocking, for a worker thread; every wait is bounded by the SDO client's.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from servo_ctrl.canopen import objects as o
from servo_ctrl.canopen.desk_objects import ABORTS, SETTINGS
from servo_ctrl.canopen.errors import SdoError
from servo_ctrl.canopen.pdo import STRUCT_FORMATS
from servo_ctrl.canopen.sdo_abort import AbortCode
from servo_ctrl.canopen.stack import SdoPort
from servo_ctrl.config.desk import (
    LEARNERS,
    AxisStatus,
    DeskStatus,
    LearningState,
    LearningStatus,
    Refusal,
    Request,
    ScrewStatus,
    Setting,
    Verdict,
)
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.learning.types import Learned, Outlook, ReversalReport

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.canopen.stack import Eds, Network

ANSWER_S = 2.0
"""Answer time granted to one request: a lockstep on a slow computer leaves others little of the bus."""
READ_TRIES = 2
WRITE_TRIES = 1
"""A command is sent once: the answer to a second one could be that the first is being carried out."""
REFUSALS = {int(code): refusal for refusal, code in ABORTS.items()} | {
    int(AbortCode.VALUE_TOO_HIGH): Refusal.OUT_OF_RANGE,
    int(AbortCode.VALUE_TOO_LOW): Refusal.OUT_OF_RANGE,
}


class RemoteDesk:
    """The `Desk` of the controller `node_id` on `network`. All calls may raise SdoError."""

    def __init__(self, network: Network, node_id: int, eds: Eds, axis_names: Sequence[str]) -> None:
        self._eds, self._names = eds, tuple(axis_names)
        self._reader = SdoPort(network, node_id, timeout_s=ANSWER_S, tries=READ_TRIES)
        self._writer = SdoPort(network, node_id, timeout_s=ANSWER_S, tries=WRITE_TRIES)

    def close(self) -> None:
        """Stop listening to the controller's answers."""
        self._reader.close()
        self._writer.close()

    def identify(self) -> None:
        """Raises SdoError when the node is something else than a controller of our kind."""
        found, wanted = self._number(*o.PRODUCT_CODE), self._eds.default(*o.PRODUCT_CODE)
        if found != wanted:
            raise SdoError(f"product code {found:08X}h is not that of a servo-ctrl ({wanted:08X}h)")

    def execute(self, request: Request) -> Verdict:
        """Carry out a command, or say why not."""
        number = self._names.index(request.axis) + 1 if request.axis else 0
        return self._write(o.AXIS_COMMAND, 0, number << 8 | request.command)

    def change(self, setting: Setting, value: float) -> Verdict:
        """Change a setting, or say why not."""
        number = round(value / o.NM) if setting is Setting.REQUIRED_M else round(value)
        return self._write(o.SETTINGS, SETTINGS.index(setting) + 1, number)

    def status(self) -> DeskStatus:
        """What there is to know now; entry after entry, so that one may be a cycle older than the next."""
        required_nm, learner, adaptation = self._numbers(o.SETTINGS)
        return DeskStatus(
            stage=self._number(o.STATE),
            cycles=self._number(o.CYCLES),
            missed_ticks=self._number(o.MISSED_TICKS),
            learning=self.learning(),
            axes=tuple(self._axis(number) for number in range(1, len(self._names[: o.AXES]) + 1)),
            settings={
                Setting.REQUIRED_M: o.value_of(required_nm, o.NM),
                Setting.LEARNER: float(learner),
                Setting.ADAPTATION: float(adaptation),
            },
            reason=self._text(o.REASON),
        )

    def learning(self) -> LearningStatus:
        """The learning run alone."""
        state, axis, done, total, remaining_s, best_nm, _, acceleration = self._numbers(o.LEARNING)
        stage = self._text(o.LEARNING_STAGE)
        outlook = Outlook(
            stage=stage,
            strokes_done=done,
            strokes_total=total,
            remaining_s=float(remaining_s),
            acceleration_m_s2=o.value_of(acceleration, o.UM_S2),
            best_m=o.value_of(best_nm, o.NM),
        )
        return LearningStatus(
            state=LearningState(state),
            axis=self._names[axis - 1] if axis else "",
            outlook=outlook if stage or total else None,
            reason=self._text(o.LEARNING_END),
        )

    def _axis(self, number: int) -> AxisStatus:
        due, reversals, *_ = monitored = self._numbers(o.MONITORING + number)
        version, learned_at, learned = self._result(number)
        return AxisStatus(
            name=self._names[number - 1],
            compensation_enabled=bool(self._number(o.COMPENSATION, number)),
            observer_enabled=bool(self._number(o.OBSERVER, number)),
            learning_due=bool(due),
            reversals=reversals,
            last=_reversal(number - 1, monitored),
            version=version,
            learned_at=learned_at,
            learned=learned,
            screw=self._screw(number),
        )

    def _screw(self, number: int) -> ScrewStatus:
        """Table and lost motion in use."""
        index, enabled = o.SCREW_RESULT + number, bool(self._number(o.SCREW, number))
        version, learned_at = self._number(index, 1), self._text(index, 2)
        before, after, lost, spread, travels, time_s, nodes = (
            self._number(index, subindex) for subindex in range(3, 10)
        )
        if not nodes:
            return ScrewStatus(enabled, version, learned_at)
        rows = o.unpacked_rows(self._read(o.SCREW_TABLE + number, 1), o.SCREW_UNITS)
        learned = ScrewLearned(
            points=tuple((a, b, c) for a, b, c in rows),
            lost_motion_m=o.value_of(lost, o.NM),
            spread_m=o.value_of(spread, o.NM),
            before_m=o.value_of(before, o.NM),
            after_m=o.value_of(after, o.NM),
            strokes=travels,
            machine_time_s=float(time_s),
        )
        return ScrewStatus(enabled, version, learned_at, learned)

    def _result(self, number: int) -> tuple[int, str, Learned | None]:
        """Version, date and functions in use."""
        index = o.RESULT + number
        version, learned_at = self._number(index, 1), self._text(index, 2)
        learner, before, after, strokes, time_s, spread, *points = (
            self._number(index, subindex) for subindex in range(3, 12)
        )
        if learner >= len(LEARNERS):
            return version, learned_at, None
        tables = [self._read(o.FUNCTIONS + number, sub) if points[sub - 1] else b"" for sub in (1, 2, 3)]
        learned = Learned(
            learner=LEARNERS[learner],
            durations=_pairs(tables[0], o.DURATION_UNITS),
            amplitudes=_pairs(tables[1], o.AMPLITUDE_UNITS),
            spread_m_s2=o.value_of(spread, o.UM_S2),
            trailing=tuple((a, b, c, d) for a, b, c, d in o.unpacked_rows(tables[2], o.TRAILING_UNITS)),
            before_m=o.value_of(before, o.NM),
            after_m=o.value_of(after, o.NM),
            strokes=strokes,
            machine_time_s=float(time_s),
        )
        return version, learned_at, learned

    def _numbers(self, index: int) -> list[int]:
        """All fields of a record of numbers."""
        highest = max(sub for entry, sub in self._eds.variables if entry == index)
        return [self._number(index, subindex) for subindex in range(1, highest + 1)]

    def _number(self, index: int, subindex: int = 0) -> int:
        layout = "<" + STRUCT_FORMATS[self._eds.variables[index, subindex].data_type]
        data = self._read(index, subindex)
        if len(data) != struct.calcsize(layout):
            raise SdoError(
                f"{index:04X}h:{subindex:02X} has {len(data)} bytes: not a servo-ctrl of this version"
            )
        return int(struct.unpack(layout, data)[0])

    def _text(self, index: int, subindex: int = 0) -> str:
        return self._read(index, subindex).decode("ascii", "replace")

    def _read(self, index: int, subindex: int) -> bytes:
        try:
            return self._reader.read(index, subindex)
        except SdoError as error:
            if error.abort_code == AbortCode.NO_DATA:
                return b""
            raise

    def _write(self, index: int, subindex: int, value: int) -> Verdict:
        layout = "<" + STRUCT_FORMATS[self._eds.variables[index, subindex].data_type]
        try:
            data = struct.pack(layout, value)
        except struct.error:
            return Verdict(Refusal.OUT_OF_RANGE, f"{value} does not fit {index:04X}h:{subindex:02X}")
        try:
            self._writer.write(index, subindex, data)
        except SdoError as error:
            refusal = REFUSALS.get(error.abort_code or 0)
            if refusal is None:
                raise
            said_why = error.abort_code in set(ABORTS.values())
            return Verdict(refusal, (said_why and self._text(o.REFUSAL)) or str(error))
        return Verdict()


def _reversal(axis: int, fields: Sequence[int]) -> ReversalReport | None:
    _, _, j, peak, rms, contour_peak, acceleration, direction, cycle = fields
    if not direction:
        return None
    return ReversalReport(
        axis=axis,
        cycle=cycle,
        direction=direction,
        acceleration_m_s2=o.value_of(acceleration, o.UM_S2),
        contour_peak_m=o.value_of(contour_peak, o.NM),
        error_peak_m=o.value_of(peak, o.NM),
        error_rms_m=o.value_of(rms, o.NM),
        error_mean_m=o.value_of(j, o.NM),
    )


def _pairs(data: bytes, units: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
    return tuple((a, b) for a, b in o.unpacked_rows(data, units))
