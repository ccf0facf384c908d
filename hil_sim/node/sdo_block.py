"""SDO block download and upload (CiA 301, 7.2.4), as objects that answer frames with frames."""

import struct
from binascii import crc_hqx

from hil_sim.node import abort_codes
from hil_sim.node.abort_codes import abort

BLOCK_SIZE = 127  # segments of a block that the server requests, the most that CiA 301 allows
LARGEST_BYTES = 1 << 20  # of a download: bounds the memory that a client can occupy


class BlockDownload:
    """Receiver of segments: counts, acknowledges, checks length and CRC at the end."""

    def __init__(self, index: int, subindex: int, size: int | None, checked: bool) -> None:
        self.address = (index, subindex)
        self.size = size
        self.checked = checked
        self.data = bytearray()
        self.sequence = 0
        self.finished = False

    def segment(self, frame: bytes) -> bytes | None:
        """Receive one segment; return the acknowledgement when the block has ended."""
        number, last = frame[0] & 0x7F, frame[0] & 0x80
        if number == 0:
            raise abort(abort_codes.INVALID_SEQUENCE_NUMBER)
        if number == self.sequence + 1:
            self.sequence = number
            self.data += frame[1:8]
            self.finished = bool(last)
            if len(self.data) > LARGEST_BYTES:
                raise abort(abort_codes.OUT_OF_MEMORY)
        if not last and number < BLOCK_SIZE:
            return None
        acknowledged, self.sequence = self.sequence, 0
        return bytes((0xA2, acknowledged, BLOCK_SIZE, 0, 0, 0, 0, 0))

    def end(self, frame: bytes) -> bytes:
        """Return the complete data. Raises SdoAbortedError on wrong length or CRC."""
        unused = (frame[0] >> 2) & 0x7
        data = bytes(self.data[: len(self.data) - unused])
        if self.size is not None and self.size != len(data):
            raise abort(abort_codes.LENGTH_MISMATCH)
        if self.checked and crc_hqx(data, 0) != int.from_bytes(frame[1:3], "little"):
            raise abort(abort_codes.CRC_ERROR)
        return data


class BlockUpload:
    """Sender of segments: repeats from the last one acknowledged."""

    def __init__(self, data: bytes, block_size: int, checked: bool) -> None:
        self.data = data
        self.block_size = block_size
        self.checked = checked
        self.acknowledged = 0  # segments of the whole transfer
        self.sent = 0  # segments of the present block
        self.ended = False

    def block(self) -> list[bytes]:
        """Return the frames of the next block."""
        total = max(1, -(-len(self.data) // 7))
        self.sent = min(self.block_size, total - self.acknowledged)
        frames = []
        for number in range(1, self.sent + 1):
            position = self.acknowledged + number
            last = 0x80 if position == total else 0
            frames.append(
                bytes((number | last,)) + self.data[7 * position - 7 : 7 * position].ljust(7, b"\0")
            )
        return frames

    def acknowledge(self, frame: bytes) -> list[bytes]:
        """Return what follows an acknowledgement: the next block, or the end with the CRC."""
        good, block_size = frame[1], frame[2]
        if good > self.sent:
            raise abort(abort_codes.INVALID_SEQUENCE_NUMBER)
        if not 1 <= block_size <= 127:
            raise abort(abort_codes.INVALID_BLOCK_SIZE)
        self.acknowledged += good
        self.block_size = block_size
        if 7 * self.acknowledged < len(self.data):
            return self.block()
        self.ended = True
        unused = 7 * self.acknowledged - len(self.data)
        crc = crc_hqx(self.data, 0) if self.checked else 0
        return [struct.pack("<BH5x", 0xC1 | unused << 2, crc)]
