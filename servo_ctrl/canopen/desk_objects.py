"""Objects 2100h-2168h and 2000h-2004h: who answers for each entry, and what a write asks of the desk."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from servo_ctrl.canopen import objects as o
from servo_ctrl.canopen import status_fields as fields_of
from servo_ctrl.canopen.sdo_abort import AbortCode, SdoAbort
from servo_ctrl.config.desk import Command, Refusal, Request, Setting, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from servo_ctrl.canopen.dictionary import Dictionary, Reader, Value, Writer
    from servo_ctrl.config.desk import AxisStatus, Desk

ABORTS = {
    Refusal.UNKNOWN: AbortCode.INVALID_VALUE,
    Refusal.OUT_OF_RANGE: AbortCode.INVALID_VALUE,
    Refusal.WRONG_STATE: AbortCode.WRONG_DEVICE_STATE,
    Refusal.STORAGE: AbortCode.CANNOT_STORE,
}
SWITCHES = {
    o.COMPENSATION: (Command.DISABLE_COMPENSATION, Command.ENABLE_COMPENSATION),
    o.OBSERVER: (Command.DISABLE_OBSERVER, Command.ENABLE_OBSERVER),
    o.SCREW: (Command.DISABLE_SCREW, Command.ENABLE_SCREW),
}
SETTINGS = (Setting.REQUIRED_M, Setting.LEARNER, Setting.ADAPTATION)
"""Subindices 1, 2, 3 of 2104h."""
STATUS = struct.Struct("<BBBBHH")
"""The status TPDO, in the order of 1A00h."""


class DeskObjects:
    """Answers for the entries of `dictionary` that the desk stands behind."""

    def __init__(self, desk: Desk, axis_names: Sequence[str], dictionary: Dictionary) -> None:
        self._desk, self._names = desk, tuple(axis_names)[: o.AXES]
        self._command = self._selection = self._axis_command = 0
        self._refusal = ""
        dictionary.readers |= {
            o.STATE: lambda _sub: desk.status().stage,
            o.CYCLES: lambda _sub: desk.status().cycles & o.NONE_32,
            o.MISSED_TICKS: lambda _sub: desk.status().missed_ticks & o.NONE_32,
            o.REASON: lambda _sub: desk.status().reason,
            o.COMMAND: lambda _sub: self._command,
            o.AXIS_SELECTION: lambda _sub: self._selection,
            o.COMPENSATION: self._per_axis(lambda axis: axis.compensation_enabled),
            o.OBSERVER: self._per_axis(lambda axis: axis.observer_enabled),
            o.SCREW: self._per_axis(lambda axis: axis.screw.enabled),
            o.SETTINGS: _record(lambda: fields_of.settings_fields(desk.status())),
            o.REFUSAL: lambda _sub: self._refusal,
            o.AXIS_COMMAND: lambda _sub: self._axis_command,
            o.LEARNING: _record(lambda: fields_of.learning_fields(desk.status())),
            o.LEARNING_STAGE: lambda _sub: fields_of.stage_text(desk.status()),
            o.LEARNING_END: lambda _sub: desk.status().learning.reason,
            o.SUMMARY: _record(lambda: fields_of.summary_fields(desk.status())),
        }
        for number in range(1, o.AXES + 1):
            dictionary.readers |= {
                o.MONITORING + number: self._axis_record(number, fields_of.monitoring_fields),
                o.RESULT + number: self._axis_record(number, fields_of.result_fields),
                o.FUNCTIONS + number: self._axis_record(number, fields_of.function_fields),
                o.SCREW_RESULT + number: self._axis_record(number, fields_of.screw_fields),
                o.SCREW_TABLE + number: self._axis_record(number, fields_of.screw_table),
            }
        dictionary.writers |= {
            o.COMMAND: self._execute,
            o.AXIS_SELECTION: self._select,
            o.COMPENSATION: self._switch(o.COMPENSATION),
            o.OBSERVER: self._switch(o.OBSERVER),
            o.SCREW: self._switch(o.SCREW),
            o.SETTINGS: self._change,
            o.AXIS_COMMAND: self._execute_for_axis,
        }

    def status_payload(self) -> bytes:
        """What the status TPDO carries now."""
        status = self._desk.status()
        state, axis, _, _, _, _, progress, _ = fields_of.learning_fields(status)
        due, _, j = fields_of.summary_fields(status)
        return STATUS.pack(status.stage, state, due, axis, progress, j)

    def _execute(self, _subindex: int, value: int) -> None:
        self._carry_out(value, self._selection)
        self._command = value

    def _execute_for_axis(self, _subindex: int, value: int) -> None:
        """One transfer, which no other client can get between."""
        axis, command = divmod(value, 0x100)
        self._check_axis(axis)
        self._carry_out(command, axis)
        self._axis_command = value

    def _carry_out(self, command: int, axis: int) -> None:
        if command not in set(Command):
            self._settle(Verdict(Refusal.UNKNOWN, f"there is no command {command}"))
        name = self._names[axis - 1] if axis else ""
        self._settle(self._desk.execute(Request(Command(command), name)))

    def _select(self, _subindex: int, value: int) -> None:
        self._check_axis(value)
        self._selection = value

    def _check_axis(self, number: int) -> None:
        if number > len(self._names):
            reason = f"there is no axis {number}; the machine has {', '.join(self._names)}"
            self._settle(Verdict(Refusal.UNKNOWN, reason))

    def _change(self, subindex: int, value: int) -> None:
        setting = SETTINGS[subindex - 1]
        in_si = o.value_of(value, o.NM) if setting is Setting.REQUIRED_M else float(value)
        self._settle(self._desk.change(setting, in_si))

    def _switch(self, index: int) -> Writer:
        def write(subindex: int, value: int) -> None:
            self._settle(self._desk.execute(Request(SWITCHES[index][value], self._name(subindex))))

        return write

    def _settle(self, verdict: Verdict) -> None:
        """Nothing when accepted; else the reason is kept for 2105h, and SdoAbort is raised."""
        if not verdict.accepted:
            self._refusal = verdict.reason
            raise SdoAbort(ABORTS[verdict.refusal])

    def _name(self, number: int) -> str:
        if number > len(self._names):
            raise SdoAbort(AbortCode.NO_SUCH_SUBINDEX)
        return self._names[number - 1]

    def _per_axis(self, value: Callable[[AxisStatus], bool]) -> Reader:
        """An array with a sub-index for every axis that the machine has."""

        def read(subindex: int) -> int:
            if not subindex:
                return len(self._names)
            self._name(subindex)
            return value(self._desk.status().axes[subindex - 1])

        return read

    def _axis_record(self, number: int, fields: Callable[[AxisStatus], Sequence[Value]]) -> Reader:
        """A record of an axis; there is none for axes that the machine has not."""
        if number > len(self._names):
            return _missing
        return _record(lambda: fields(self._desk.status().axes[number - 1]))


def _record(fields: Callable[[], Sequence[Value]]) -> Reader:
    def read(subindex: int) -> Value:
        values = fields()
        return values[subindex - 1] if subindex else len(values)

    return read


def _missing(_subindex: int) -> Value:
    raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
