"""The object dictionary of our own node: data types, access, limits and defaults of the EDS.

It holds no values: variable entries have a reader, writable entries a writer, and all others are the defaults
of the EDS.
"""

import struct
from collections.abc import Callable

from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.canopen.pdo import STRUCT_FORMATS
from servo_ctrl.canopen.stack import Eds, EdsVariable

Value = int | str | bytes
Reader = Callable[[int], Value]
Writer = Callable[[int, int], None]


class Dictionary:
    """Entries by index and subindex.

    `readers[index](subindex)` returns a value, `writers[index](subindex, value)` sets one; both may raise
    SdoAbort. Only numbers can be written.
    """

    def __init__(self, eds: Eds) -> None:
        self.readers: dict[int, Reader] = {}
        self.writers: dict[int, Writer] = {}
        self._variables = eds.variables
        self._indices = {index for index, _ in eds.variables}

    def read(self, index: int, subindex: int) -> bytes:
        """Return the encoded value of an entry. Raises SdoAbort."""
        variable = self._variable(index, subindex)
        if variable.access == "wo":
            raise SdoAbort(AbortCode.READ_OF_WRITE_ONLY)
        reader = self.readers.get(index)
        value = reader(subindex) if reader is not None else variable.default
        return _encoded(value, variable)

    def writable_size(self, index: int, subindex: int) -> int:
        """Return the number of bytes of a writable entry. Raises SdoAbort for any other."""
        variable = self._variable(index, subindex)
        if "w" not in variable.access or index not in self.writers:
            raise SdoAbort(AbortCode.WRITE_OF_READ_ONLY)
        return struct.calcsize(STRUCT_FORMATS[variable.data_type])

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an entry from its `writable_size` bytes. Raises SdoAbort."""
        variable = self._variable(index, subindex)
        (value,) = struct.unpack("<" + STRUCT_FORMATS[variable.data_type], data)
        if variable.high is not None and value > variable.high:
            raise SdoAbort(AbortCode.VALUE_TOO_HIGH)
        if variable.low is not None and value < variable.low:
            raise SdoAbort(AbortCode.VALUE_TOO_LOW)
        self.writers[index](subindex, value)

    def _variable(self, index: int, subindex: int) -> EdsVariable:
        if index not in self._indices:
            raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
        variable = self._variables.get((index, subindex))
        if variable is None:
            raise SdoAbort(AbortCode.NO_SUCH_SUBINDEX)
        return variable


def _encoded(value: Value | None, variable: EdsVariable) -> bytes:
    match value:
        case int():
            return struct.pack("<" + STRUCT_FORMATS[variable.data_type], value)
        case str():
            return value.encode("ascii", "replace")
    return value or b""
