"""Block transfers of our SDO server (CiA 301, 7.2.4): one acknowledgement for many segments, and a CRC."""

from binascii import crc_hqx
from collections import deque
from collections.abc import Callable

from servo_ctrl.canopen.errors import AbortCode, SdoAbort

SEGMENT_BYTES = 7
"""Bytes that a segment carries (CiA 301)."""
SEGMENTS_MAX = 127
"""Largest number of segments in a block (CiA 301)."""
LAST = 0x80
"""Bit in the sequence number of the last segment."""
UPLOAD, DOWNLOAD = 5, 6
"""Client command specifiers: the upper three bits of a request's first byte."""


def padded(*head: int) -> bytes:
    """Return a frame of 8 bytes that begins with `head`."""
    return bytes(head).ljust(8, b"\0")


class BlockUpload:
    """Sends `data` in blocks of `size` segments; segments that are not acknowledged are sent again."""

    def __init__(self, data: bytes, size: int, *, with_crc: bool) -> None:
        self.finished = False
        self.pending: deque[bytes] = deque()
        """Segments of the present block that are still to be sent."""
        self._data = data
        self._crc = crc_hqx(data, 0) if with_crc else 0
        self._size = _checked_block_size(size)
        self._acknowledged = 0
        """Number of acknowledged segments."""
        self._sent = 0
        """Number of segments in the present block."""
        self._ending = False

    def accepts(self, frame: bytes) -> bool:
        """Whether a frame belongs to this transfer; another initiate does not."""
        return frame[0] >> 5 == UPLOAD and bool(frame[0] & 0x03)

    def serve(self, frame: bytes) -> bytes:
        """Return the response to a frame; the segments of a block go to `pending`. Raises SdoAbort."""
        match frame[0] & 0x1F:
            case 0x03 if not self._sent and not self._ending:
                return self._block()
            case 0x02 if self._sent:
                if frame[1] > self._sent:
                    raise SdoAbort(AbortCode.INVALID_SEQUENCE_NUMBER)
                self._size = _checked_block_size(frame[2])
                self._acknowledged, self._sent = self._acknowledged + frame[1], 0
                unused = SEGMENT_BYTES * self._acknowledged - len(self._data)
                if unused < 0:
                    return self._block()
                self._ending = True
                return padded(0xC1 | unused << 2, self._crc & 0xFF, self._crc >> 8)
            case 0x01 if self._ending:
                self.finished = True
                return b""
        raise SdoAbort(AbortCode.INVALID_COMMAND)

    def _block(self) -> bytes:
        remaining = self._data[SEGMENT_BYTES * self._acknowledged :]
        segments = [remaining[k : k + SEGMENT_BYTES] for k in range(0, len(remaining), SEGMENT_BYTES)]
        block = segments[: self._size]
        self._sent = len(block)
        self.pending.clear()
        for number, segment in enumerate(block, start=1):
            last = LAST if number == len(segments) else 0
            self.pending.append(bytes((number | last,)) + segment.ljust(SEGMENT_BYTES, b"\0"))
        return b""


class BlockDownload:
    """Receives the `entry_size` bytes of an entry, and passes them to `write` at the end."""

    def __init__(self, entry_size: int, *, with_crc: bool, write: Callable[[bytes], None]) -> None:
        self.finished = False
        self._entry_size, self._with_crc, self._write = entry_size, with_crc, write
        self._data = b""
        self._sequence_number = 0
        self._complete = False

    def accepts(self, _frame: bytes) -> bool:
        """Whether a frame belongs to this transfer: all do, as a segment has no specifier."""
        return True

    def serve(self, frame: bytes) -> bytes:
        """Receive a segment or the end; return the response. Raises SdoAbort."""
        if self._complete:
            return self._end(frame)
        number = frame[0] & ~LAST
        if not number:
            raise SdoAbort(AbortCode.INVALID_SEQUENCE_NUMBER)
        if number == self._sequence_number + 1:
            self._sequence_number, self._data = number, self._data + frame[1:]
            self._complete = bool(frame[0] & LAST)
            if len(self._data) >= self._entry_size + SEGMENT_BYTES:
                raise SdoAbort(AbortCode.TOO_LONG)
        if not frame[0] & LAST and number < SEGMENTS_MAX:
            return b""
        received, self._sequence_number = self._sequence_number, 0
        return padded(0xA2, received, SEGMENTS_MAX)

    def _end(self, frame: bytes) -> bytes:
        if frame[0] & 0xE3 != 0xC1:
            raise SdoAbort(AbortCode.INVALID_COMMAND)
        data = self._data[: len(self._data) - (frame[0] >> 2 & 0x07)]
        if self._with_crc and crc_hqx(data, 0) != int.from_bytes(frame[1:3], "little"):
            raise SdoAbort(AbortCode.CRC_ERROR)
        self._write(data)
        self.finished = True
        return padded(0xA1)


def _checked_block_size(size: int) -> int:
    if not 1 <= size <= SEGMENTS_MAX:
        raise SdoAbort(AbortCode.INVALID_BLOCK_SIZE)
    return size
