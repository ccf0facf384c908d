"""SDO client for commands and status of a running controller, for the command line; see `command_objects`.

Blocking, for a worker thread; the SDO client bounds every wait.
"""

import struct
from collections.abc import Sequence
from typing import Any

from servo_ctrl.canopen.command_objects import ABORTS
from servo_ctrl.canopen.dictionary import Value
from servo_ctrl.canopen.errors import AbortCode, SdoError
from servo_ctrl.canopen.pdo import STRUCT_FORMATS
from servo_ctrl.canopen.stack import Eds, Network, SdoPort
from servo_ctrl.canopen.status_codec import build_record, decoded, object_fields
from servo_ctrl.commands import controller_objects as o
from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.command import CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.field import AXES, DataType
from servo_ctrl.commands.learning_status import LearningStatus
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import SETTINGS

RESPONSE_TIMEOUT_S = 2.0
"""Longest wait for an SDO response; chosen: lockstep on a slow computer leaves little bus time to others."""
READ_TRIES = 2
"""Requests of a read; chosen: reading has no effect, so it may be repeated."""
WRITE_TRIES = 1
"""A command is sent once: a second request could be refused because the first is being executed."""
REFUSALS = {int(code): refusal for refusal, code in ABORTS.items()} | {
    int(AbortCode.VALUE_TOO_HIGH): Refusal.OUT_OF_RANGE,
    int(AbortCode.VALUE_TOO_LOW): Refusal.OUT_OF_RANGE,
}


class RemoteController:
    """Client of the controller `node_id` on `network`. All calls may raise SdoError."""

    def __init__(self, network: Network, node_id: int, eds: Eds, axis_names: Sequence[str]) -> None:
        self._eds, self._names = eds, tuple(axis_names)
        self._reader = SdoPort(network, node_id, timeout_s=RESPONSE_TIMEOUT_S, tries=READ_TRIES)
        self._writer = SdoPort(network, node_id, timeout_s=RESPONSE_TIMEOUT_S, tries=WRITE_TRIES)

    def close(self) -> None:
        """Stop receiving the controller's responses."""
        self._reader.close()
        self._writer.close()

    def identify(self) -> None:
        """Raise SdoError unless the node is a servo-ctrl."""
        code, expected_code = self._number(*o.PRODUCT_CODE, DataType.U32), self._eds.default(*o.PRODUCT_CODE)
        if code != expected_code:
            raise SdoError(f"product code {code:08X}h is not that of a servo-ctrl ({expected_code:08X}h)")

    def execute(self, request: CommandRequest) -> CommandResult:
        """Request a command; return its result."""
        number = self._names.index(request.axis) + 1 if request.axis else 0
        return self._write(o.AXIS_COMMAND, 0, number << 8 | request.command)

    def change(self, setting: str, value: float | str | bool) -> CommandResult:
        """Change a setting; return the result."""
        entry = SETTINGS[setting].entry
        number = entry.names.index(value) if isinstance(value, str) else round(value / (entry.unit or 1.0))
        return self._write(entry.index, entry.subindex, number)

    def status(self) -> MachineStatus:
        """Read the status entry by entry; entries may be of different cycles."""
        axes = tuple(
            self._record(AxisStatus, {"name": name}, number)
            for number, name in enumerate(self._names[:AXES], start=1)
        )
        status: MachineStatus = self._record(MachineStatus, {"axes": axes})
        return status

    def learning(self) -> LearningStatus:
        """Read the status of the learning run."""
        learning: LearningStatus = self._record(LearningStatus, {})
        return learning

    def _record(self, kind: Any, preset: dict[str, Any], axis: int = 0) -> Any:
        """Read a status record entry by entry, except derived fields; `preset`: fields without an entry."""
        values: dict[tuple[str, ...], Any] = {}
        rows: dict[tuple[str, ...], int] = {}
        row_counts_first = sorted(object_fields(kind), key=lambda object_field: not object_field[0].rows)
        for (path, _field, hint, counts), entry in row_counts_first:
            if hint is None:
                continue
            address = entry.of_axis(axis)
            if counts:
                rows[path] = self._number(*address, entry.data_type)
            elif rows.get(path) == 0:
                values[path] = ()
            else:
                values[path] = decoded(self._value(*address, entry.data_type), entry, hint, self._names)
        return build_record(kind, values, preset)

    def _value(self, index: int, subindex: int, data_type: DataType) -> Value:
        if data_type is DataType.TABLE:
            return self._read(index, subindex)
        if data_type is DataType.TEXT:
            return self._read(index, subindex).decode("ascii", "replace")
        return self._number(index, subindex, data_type)

    def _number(self, index: int, subindex: int, data_type: DataType) -> int:
        data, layout = self._read(index, subindex), "<" + STRUCT_FORMATS[data_type]
        if len(data) != struct.calcsize(layout):
            place = f"{index:04X}h:{subindex:02X}"
            raise SdoError(f"{place} has {len(data)} bytes: not a servo-ctrl of this version")
        return int(struct.unpack(layout, data)[0])

    def _read(self, index: int, subindex: int) -> bytes:
        try:
            return self._reader.read(index, subindex)
        except SdoError as error:
            if error.abort_code == AbortCode.NO_DATA:
                return b""
            raise

    def _write(self, index: int, subindex: int, value: int) -> CommandResult:
        layout = "<" + STRUCT_FORMATS[self._eds.variables[index, subindex].data_type]
        try:
            data = struct.pack(layout, value)
        except struct.error:
            return CommandResult(Refusal.OUT_OF_RANGE, f"{value} does not fit {index:04X}h:{subindex:02X}")
        try:
            self._writer.write(index, subindex, data)
        except SdoError as error:
            refusal = REFUSALS.get(error.abort_code or 0)
            if refusal is None:
                raise
            has_reason = error.abort_code in set(ABORTS.values())
            reason = self._read(o.REFUSAL, 0).decode("ascii", "replace") if has_reason else ""
            return CommandResult(refusal, reason or str(error))
        return CommandResult()
