"""Codecs of PDOs: object names from the machine file, data types from the EDS, one `struct` per PDO."""

import re
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.stack import Eds, EdsVariable

STRUCT_FORMATS: dict[int, str] = {
    0x02: "b",  # INTEGER8
    0x03: "h",  # INTEGER16
    0x04: "i",  # INTEGER32
    0x05: "B",  # UNSIGNED8
    0x06: "H",  # UNSIGNED16
    0x07: "I",  # UNSIGNED32
    0x08: "f",  # REAL32
    0x11: "d",  # REAL64
    0x15: "q",  # INTEGER64
    0x1B: "Q",  # UNSIGNED64
}
"""CiA 301 data type -> struct format. Booleans and widths of 24, 40, ... bits are not supported."""
PDO_BYTES_MAX = 8
"""Data bytes of a CAN frame."""
COB_ID_INVALID = 1 << 31
"""Bit of a PDO's COB-ID that switches the PDO off (CiA 301)."""
_ADDRESS = re.compile(r"0x([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})")


@dataclass(frozen=True, slots=True)
class MappedObject:
    """One object inside a PDO. `format` is its struct character, always little-endian, unpadded."""

    name: str
    index: int
    subindex: int
    format: str

    @property
    def bits(self) -> int:
        """Length in bits."""
        return 8 * struct.calcsize("<" + self.format)

    @property
    def mapping_entry(self) -> int:
        """Entry of 1600h/1A00h: index, subindex and length in bits, as one UNSIGNED32."""
        return self.index << 16 | self.subindex << 8 | self.bits

    @property
    def address(self) -> tuple[int, int]:
        """(index, subindex)."""
        return self.index, self.subindex


class PdoCodec:
    """Packs and unpacks the values of one PDO in mapping order, in device units."""

    def __init__(self, objects: Sequence[MappedObject]) -> None:
        self.objects = tuple(objects)
        self.layout = struct.Struct("<" + "".join(mapped.format for mapped in objects))
        self.size = self.layout.size

    def pack(self, *values: float) -> bytes:
        """Pack the payload. Raises struct.error when a value does not fit its type."""
        return self.layout.pack(*values)

    def unpack(self, payload: bytes | bytearray) -> tuple[int, ...]:
        """Unpack the values. Raises struct.error when the payload has another length."""
        return self.layout.unpack(payload)

    def position(self, index: int, subindex: int = 0) -> int | None:
        """Index of an object among the values; None when it is not mapped."""
        places = {mapped.address: place for place, mapped in enumerate(self.objects)}
        return places.get((index, subindex))


def compile_pdo(eds: Eds, names: Iterable[str], *, receive: bool) -> PdoCodec:
    """Compile the codec of a mapping of names or addresses ("controlword", "0x6071:00").

    `receive`: True for an RPDO (its objects must be writable), False for a TPDO. Raises EdsError naming the
    EDS and the object: unknown, not mappable, of a type without a codec, or more than 8 bytes together.
    """
    objects = [_mapped(eds, name, receive=receive) for name in names]
    codec = PdoCodec(objects)
    if codec.size > PDO_BYTES_MAX:
        names_mapped = ", ".join(mapped.name for mapped in objects)
        raise EdsError(f"{eds.path}: {names_mapped} are {codec.size} bytes; a PDO carries {PDO_BYTES_MAX}")
    return codec


def _mapped(eds: Eds, name: str, *, receive: bool) -> MappedObject:
    variable = find(eds, name)
    allowed = {"rw", "rww", "wo"} if receive else {"ro", "rw", "rwr", "const"}
    if not variable.pdo_mappable or variable.access not in allowed:
        kind = "an RPDO" if receive else "a TPDO"
        raise EdsError(f"{eds.path}: {name} ({variable.address}) cannot be mapped into {kind}, its EDS says")
    if variable.data_type not in STRUCT_FORMATS:
        kind = f"data type 0x{variable.data_type:02X}"
        raise EdsError(f"{eds.path}: {name} ({variable.address}) has {kind}, not a number")
    return MappedObject(variable.name, variable.index, variable.subindex, STRUCT_FORMATS[variable.data_type])


def find(eds: Eds, name: str) -> EdsVariable:
    """Find the EDS entry of a name or address. Raises EdsError naming EDS and object."""
    if match := _ADDRESS.fullmatch(name):
        variable = eds.variables.get((int(match[1], 16), int(match[2], 16)))
    else:
        variable = next((v for v in eds.variables.values() if v.name == name), None)
    if variable is None:
        raise EdsError(f'{eds.path}: has no object "{name}"')
    return variable
