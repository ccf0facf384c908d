"""Mapping of the status TPDO, 1A00h: the objects of our node that it carries (CiA 301, 7.5.2.36).

A client changes it as on any node: TPDO off, number of entries 0, entries, number, TPDO on.
"""

import struct
from collections.abc import Callable, Container, Mapping, Sequence

from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.canopen.pdo import STRUCT_FORMATS
from servo_ctrl.canopen.stack import Eds
from servo_ctrl.commands.eds_sections import MOST_MAPPED

PDO_BITS_MAX = 64
"""Bits of the data of a CAN frame."""
ObjectAddress = tuple[int, int]
"""Index and subindex."""


def setting_name(subindex: int) -> str:
    """Name of an entry of 1A00h among the stored settings."""
    return f"mapping_{subindex}"


class StatusMapping:
    """Entries of 1A00h, at power-on those of `stored` where they fit, else those of the EDS.

    `fields`: addresses of the existing status fields; `is_on`: whether the TPDO is on, which forbids changes.
    """

    def __init__(
        self,
        eds: Eds,
        index: int,
        fields: Container[ObjectAddress],
        is_on: Callable[[], bool],
        stored: Mapping[str, int],
    ) -> None:
        self._variables, self._fields, self._is_on = eds.variables, fields, is_on
        eds_mapping = [eds.default(index, subindex) or 0 for subindex in range(MOST_MAPPED + 1)]
        stored_mapping = [stored.get(setting_name(subindex), 0) for subindex in range(MOST_MAPPED + 1)]
        self._default = stored_mapping if stored_mapping[0] and self._fits(stored_mapping) else eds_mapping
        self.reset()

    @property
    def places(self) -> tuple[ObjectAddress, ...]:
        """The mapped objects in order."""
        return tuple((entry >> 16, entry >> 8 & 0xFF) for entry in self._values[1 : self._values[0] + 1])

    def settings(self) -> dict[str, int]:
        """Return the entries by their names among the stored settings."""
        return {setting_name(subindex): value for subindex, value in enumerate(self._values)}

    def reset(self) -> None:
        """Return to the mapping at power-on."""
        self._values = list(self._default)

    def read(self, subindex: int) -> int:
        """Read an entry; 0 is their number."""
        return self._values[subindex]

    def write(self, subindex: int, value: int) -> None:
        """Change an entry or their number. Raises SdoAbort."""
        if self._is_on() or (subindex and self._values[0]):
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
        if not subindex:
            self._check_length(value, self._values)
        elif value:
            self._bits(value)
        self._values[subindex] = value

    def _check_length(self, number: int, values: Sequence[int]) -> None:
        """Check that the first `number` entries fit into a PDO. Raises SdoAbort."""
        if number > MOST_MAPPED:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        if sum(map(self._bits, values[1 : number + 1])) > PDO_BITS_MAX:
            raise SdoAbort(AbortCode.PDO_LENGTH_EXCEEDED)

    def _bits(self, entry: int) -> int:
        """Return the bits of an entry. Raises SdoAbort for an absent or unmappable object."""
        address, bits = (entry >> 16, entry >> 8 & 0xFF), entry & 0xFF
        variable = self._variables.get(address)
        if variable is None:
            raise SdoAbort(AbortCode.NO_SUCH_OBJECT)
        if address not in self._fields or not variable.pdo_mappable:
            raise SdoAbort(AbortCode.CANNOT_BE_MAPPED)
        if bits != 8 * struct.calcsize(STRUCT_FORMATS[variable.data_type]):
            raise SdoAbort(AbortCode.CANNOT_BE_MAPPED)
        return bits

    def _fits(self, values: Sequence[int]) -> bool:
        try:
            self._check_length(values[0], values)
        except SdoAbort:
            return False
        return True
