"""Our objects for commands and status fields, read from and written to the command handler."""

import struct
from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from typing import Any

from servo_ctrl.canopen.dictionary import Dictionary, Reader, Value, Writer
from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.canopen.pdo import STRUCT_FORMATS
from servo_ctrl.canopen.status_codec import ObjectField, decoded, object_fields
from servo_ctrl.commands import controller_objects as o
from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.command import COMMAND_OF, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.field import AXES, PerAxis
from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import Settings

ABORTS = {
    Refusal.UNKNOWN: AbortCode.INVALID_VALUE,
    Refusal.OUT_OF_RANGE: AbortCode.INVALID_VALUE,
    Refusal.WRONG_STATE: AbortCode.WRONG_DEVICE_STATE,
    Refusal.STORAGE: AbortCode.CANNOT_STORE,
}


class CommandObjects:
    """Registers readers and writers in `dictionary` for the entries of commands and status fields."""

    def __init__(self, handler: CommandHandler, axis_names: Sequence[str], dictionary: Dictionary) -> None:
        self._handler, self._names = handler, tuple(axis_names)[:AXES]
        self._command = self._selection = self._axis_command = 0
        self._refusal = ""
        self.fields: dict[tuple[int, int], tuple[ObjectField, int]] = {}
        """Status fields and their axes, from 1 (0: the machine), by index and subindex."""
        readers: defaultdict[int, dict[int, Callable[[], Value]]] = defaultdict(dict)
        for field in object_fields(MachineStatus):
            readers[field.entry.index][field.entry.subindex] = partial(self._value, field)
            self.fields[field.entry.index, field.entry.subindex] = field, 0
        for field, number in product(object_fields(AxisStatus), range(1, AXES + 1)):
            index, subindex = field.entry.of_axis(number)
            if number <= len(self._names):
                readers[index][subindex] = partial(self._value, field, number)
                self.fields[index, subindex] = field, number
            elif field.entry.axis is PerAxis.INDEX:
                dictionary.readers[index] = _absent_axis
        dictionary.readers |= {index: _reader(subindices) for index, subindices in readers.items()}
        dictionary.readers |= {
            o.COMMAND: lambda _sub: self._command,
            o.AXIS_SELECTION: lambda _sub: self._selection,
            o.REFUSAL: lambda _sub: self._refusal,
            o.AXIS_COMMAND: lambda _sub: self._axis_command,
        }
        dictionary.writers |= {
            o.COMMAND: self._execute,
            o.AXIS_SELECTION: self._select,
            o.SETTINGS: self._change,
            o.AXIS_COMMAND: self._execute_for_axis,
            **{index: self._switch(index) for index in o.SWITCHES},
        }

    def payload(self, places: Sequence[tuple[int, int]]) -> bytes:
        """Return the PDO data of these status fields, given by index and subindex."""
        status, mapped = self._handler.status(), [self.fields[place] for place in places]
        layout = "".join(STRUCT_FORMATS[field.entry.data_type] for field, _axis in mapped)
        values = (field.of(status.axes[axis - 1] if axis else status, self._names) for field, axis in mapped)
        return struct.pack(f"<{layout}", *values)

    def _value(self, field: ObjectField, axis: int = 0) -> Value:
        """Return the value of a field of the machine (axis 0) or of an axis, numbered from 1."""
        status = self._handler.status()
        return field.of(status.axes[axis - 1] if axis else status, self._names)

    def _execute(self, _subindex: int, value: int) -> None:
        self._execute_command(value, self._selection)
        self._command = value

    def _execute_for_axis(self, _subindex: int, value: int) -> None:
        """Take axis and command in one transfer: no other client can select another axis in between."""
        axis, command = divmod(value, 0x100)
        self._check_axis(axis)
        self._execute_command(command, axis)
        self._axis_command = value

    def _execute_command(self, command: int, axis: int) -> None:
        if command not in COMMAND_OF:
            self._abort_if_refused(CommandResult(Refusal.UNKNOWN, f"there is no command {command}"))
        name = self._names[axis - 1] if axis else ""
        self._abort_if_refused(self._handler.execute(CommandRequest(COMMAND_OF[command], name)))

    def _select(self, _subindex: int, value: int) -> None:
        self._check_axis(value)
        self._selection = value

    def _check_axis(self, number: int) -> None:
        if number > len(self._names):
            reason = f"there is no axis {number}; the machine has {', '.join(self._names)}"
            self._abort_if_refused(CommandResult(Refusal.UNKNOWN, reason))

    def _change(self, subindex: int, value: int) -> None:
        field = next(field for field in object_fields(Settings) if field.entry.subindex == subindex)
        setting: Any = decoded(value, field.entry, field.status_field.hint)
        self._abort_if_refused(self._handler.change(field.status_field.path[0], setting))

    def _switch(self, index: int) -> Writer:
        def write(subindex: int, value: int) -> None:
            if subindex > len(self._names):
                raise SdoAbort(AbortCode.NO_SUCH_SUBINDEX)
            command = o.SWITCHES[index][value]
            self._abort_if_refused(self._handler.execute(CommandRequest(command, self._names[subindex - 1])))

        return write

    def _abort_if_refused(self, result: CommandResult) -> None:
        """Raise SdoAbort for a refusal, and store its reason for 2105h."""
        if not result.accepted:
            self._refusal = result.reason
            raise SdoAbort(ABORTS[result.refusal])


def _reader(subindices: dict[int, Callable[[], Value]]) -> Reader:
    """Make a reader for the entries of one object; subindex 0 of a record is the highest subindex."""

    def read(subindex: int) -> Value:
        if subindex in subindices:
            return subindices[subindex]()
        if subindex:
            raise SdoAbort(AbortCode.NO_SUCH_SUBINDEX)
        return max(subindices)

    return read


def _absent_axis(_subindex: int) -> Value:
    """Reader for an object of an axis that the machine lacks. Raises SdoAbort."""
    raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
