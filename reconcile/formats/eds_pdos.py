"""The PDOs of a node, from its EDS and SDO downloads (CiA 301); the one file with canopen's EDS reader."""

import configparser
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.lean_import import as_if_absent
from reconcile.errors import ReconcileError
from servo_ctrl.errors import first_line

with as_if_absent("asammdf"):  # canopen brings python-can, which loads it for MF4 logs, and pandas with it
    import canopen
    from canopen.objectdictionary import ObjectDictionaryError, ODVariable

NUMPY_TYPES: dict[int, str] = {
    0x01: "?",
    0x02: "<i1",
    0x03: "<i2",
    0x04: "<i4",
    0x05: "<u1",
    0x06: "<u2",
    0x07: "<u4",
    0x08: "<f4",
    0x11: "<f8",
    0x15: "<i8",
    0x1B: "<u8",
}
"""CiA 301 data type -> numpy type."""
COMMUNICATION_OBJECTS = (0x1400, 0x1800)
MAPPING_OFFSET = 0x200  # 1600h belongs to 1400h, 1A00h to 1800h
PDOS_OF_A_KIND = 512
MOST_OBJECTS = 64
"""Most mapped objects of a PDO (CiA 301)."""
MULTIPLEXED = {0xFE, 0xFF}
"""Numbers of objects that mark multiplexed PDOs, which have no fixed layout."""
INVALID_BIT = 1 << 31
IDENTIFIER_MASK = 0x7FF


class Pdo(NamedTuple):
    """One PDO: identifier, and objects (index, subindex) with their layout in the payload."""

    cob_id: int
    objects: tuple[tuple[int, int], ...]
    layout: np.dtype[np.void]

    def values(self, payloads: bytes, position: int) -> NDArray[np.float64]:
        """Return the values of one object from concatenated payloads."""
        return np.frombuffer(payloads, dtype=self.layout)[f"f{position}"].astype(np.float64)


def pdos_of(eds: Path, node_id: int, written: dict[tuple[int, int], int]) -> list[Pdo]:
    """Return the valid PDOs with mapped objects. `written`: (index, subindex) -> value of SDO downloads.

    Raises ReconcileError naming the EDS.
    """
    dictionary = _dictionary(eds, node_id)
    indices = {*dictionary.indices, *(index for index, _ in written)}
    found = []
    for first in COMMUNICATION_OBJECTS:
        for index in sorted(indices.intersection(range(first, first + PDOS_OF_A_KIND))):
            cob_id = _value(dictionary, written, index, 1)
            count = _value(dictionary, written, index + MAPPING_OFFSET, 0)
            if cob_id is None or not count or cob_id & INVALID_BIT or count in MULTIPLEXED:
                continue
            if not 0 < count <= MOST_OBJECTS:
                reason = (
                    f"maps {count} objects, by the EDS or by what was written; {MOST_OBJECTS} are the most"
                )
                raise ReconcileError(eds, f"PDO {cob_id & IDENTIFIER_MASK:03X}h", reason)
            entries = [_value(dictionary, written, index + MAPPING_OFFSET, i + 1) or 0 for i in range(count)]
            found.append(_pdo(eds, dictionary, cob_id & IDENTIFIER_MASK, entries))
    return found


def _dictionary(eds: Path, node_id: int) -> canopen.ObjectDictionary:
    try:
        return canopen.import_od(str(eds), node_id)
    except OSError as error:
        raise ReconcileError(eds, "", error.strerror or "cannot be read") from error
    except (configparser.Error, ObjectDictionaryError, ValueError, KeyError) as error:
        raise ReconcileError(eds, "", f"is not a readable EDS: {first_line(error)}") from error


def _value(
    dictionary: canopen.ObjectDictionary, written: dict[tuple[int, int], int], index: int, subindex: int
) -> int | None:
    if (index, subindex) in written:
        return written[index, subindex]
    variable = _variable(dictionary, index, subindex)
    default = variable.default if variable is not None else None
    return default if isinstance(default, int) else None


def _variable(dictionary: canopen.ObjectDictionary, index: int, subindex: int) -> ODVariable | None:
    entry = dictionary.indices.get(index)
    if entry is None or isinstance(entry, ODVariable):
        return entry if subindex == 0 else None
    variable: ODVariable | None = entry.subindices.get(subindex)
    return variable


def _pdo(eds: Path, dictionary: canopen.ObjectDictionary, cob_id: int, entries: list[int]) -> Pdo:
    objects: list[tuple[int, int]] = []
    types: list[str] = []
    for entry in entries:
        index, subindex, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
        variable = _variable(dictionary, index, subindex)
        numpy_type = NUMPY_TYPES.get(variable.data_type or 0) if variable is not None else None
        if index < 0x20 or numpy_type is None:
            numpy_type = f"V{bits // 8}"  # a dummy, or a type that is not a number: a gap of its length
        if np.dtype(numpy_type).itemsize * 8 != bits:
            reason = f"maps {index:04X}h:{subindex:02X} with {bits} bits, which is not the length of its type"
            raise ReconcileError(eds, f"PDO {cob_id:03X}h", reason)
        objects.append((index, subindex))
        types.append(numpy_type)
    layout = np.dtype([(f"f{i}", numpy_type) for i, numpy_type in enumerate(types)])
    return Pdo(cob_id, tuple(objects), layout)
