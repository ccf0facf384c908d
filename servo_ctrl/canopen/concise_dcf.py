"""Concise DCF (CiA 302, object 1F22h): the configuration of a node as a block of bytes, as dcfgen writes it.

Layout, little-endian: number of entries u32; for each entry index u16, subindex u8, size u32, data.
"""

import struct
from dataclasses import dataclass
from pathlib import Path

from servo_ctrl.canopen.errors import EdsError

_COUNT, _ENTRY = struct.Struct("<I"), struct.Struct("<HBI")
LARGEST_BYTES = 1 << 20
"""Largest file that is read; chosen."""


@dataclass(frozen=True, slots=True)
class SdoDownload:
    """One SDO download."""

    index: int
    subindex: int
    data: bytes


def read_concise_dcf(path: Path) -> tuple[SdoDownload, ...]:
    """Read the entries of a file, in its order. Raises EdsError naming the file."""
    try:
        with path.open("rb") as file:
            block = file.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise EdsError(f"{path}: concise DCF cannot be read: {error.strerror}") from None
    if len(block) > LARGEST_BYTES:
        raise EdsError(f"{path}: a concise DCF of more than {LARGEST_BYTES} bytes")
    try:
        return tuple(_entries(block))
    except (struct.error, ValueError) as error:
        raise EdsError(f"{path}: no concise DCF: {error}") from None


def _entries(block: bytes) -> list[SdoDownload]:
    (count,) = _COUNT.unpack_from(block)
    offset, entries = _COUNT.size, []
    for number in range(1, count + 1):
        index, subindex, size = _ENTRY.unpack_from(block, offset)
        offset += _ENTRY.size
        if offset + size > len(block):
            raise ValueError(f"entry {number}, {index:04X}h:{subindex:02X}, is cut off")
        entries.append(SdoDownload(index, subindex, block[offset : offset + size]))
        offset += size
    if offset != len(block):
        raise ValueError(f"{len(block) - offset} bytes after the last entry")
    return entries
