"""SDO transfers of more than one frame (CiA 301, 7.2.4): segmented and block, as objects that answer frames.

`takes` returns whether a frame belongs to the transfer; `serve` answers it with any number of frames, and
raises SdoAbort where it does not fit. A transfer has `ended` when it expects no further frame. `store`
receives all bytes of a download.
"""

from abc import ABC, abstractmethod
from binascii import crc_hqx
from collections.abc import Callable

from hil_sim.node.sdo_abort import AbortCode, SdoAbort, wrong_length

DOWNLOAD_SEGMENT, UPLOAD_SEGMENT, BLOCK_UPLOAD = 0, 3, 5
"""Client command specifiers: the upper three bits of a frame's first byte."""
SEGMENT_BYTES = 7
TOGGLE = 0x10
BLOCK_SIZE = 127
"""Segments of a block that the server requests: the most that CiA 301 allows."""
LARGEST_BYTES = 1 << 20
"""Bounds a download, and so the memory that a client can occupy (chosen)."""


class Transfer(ABC):
    """A transfer in progress."""

    ended = False

    @abstractmethod
    def takes(self, frame: bytes) -> bool:
        """Return whether a frame of eight bytes belongs to this transfer."""

    @abstractmethod
    def serve(self, frame: bytes) -> list[bytes]:
        """Return the frames that answer `frame`. Raises SdoAbort."""


class SegmentedDownload(Transfer):
    """Receives segments; `size` is the number of bytes that the client announced, or None."""

    def __init__(self, store: Callable[[bytes], None], size: int | None) -> None:
        self._store = store
        self._size = size
        self._data = b""
        self._toggle = 0

    def takes(self, frame: bytes) -> bool:
        """Return whether the frame is a download segment."""
        return frame[0] >> 5 == DOWNLOAD_SEGMENT

    def serve(self, frame: bytes) -> list[bytes]:
        """Acknowledge a segment; the last one stores the data."""
        data = self._data + frame[1 : 8 - (frame[0] >> 1 & 0x7)]
        last = bool(frame[0] & 0x1)
        if self._size is not None and (len(data) > self._size or (last and len(data) != self._size)):
            raise wrong_length(len(data), self._size)
        if len(data) > LARGEST_BYTES:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)
        if frame[0] & TOGGLE != self._toggle:
            raise SdoAbort(AbortCode.TOGGLE_NOT_ALTERNATED)
        self._data = data
        if last:
            self._store(data)
            self.ended = True
        answer = bytes((0x20 | self._toggle,)).ljust(8, b"\0")
        self._toggle ^= TOGGLE
        return [answer]


class SegmentedUpload(Transfer):
    """Sends a segment at each request."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._toggle = 0

    def takes(self, frame: bytes) -> bool:
        """Return whether the frame requests an upload segment."""
        return frame[0] >> 5 == UPLOAD_SEGMENT

    def serve(self, frame: bytes) -> list[bytes]:
        """Send the next segment."""
        if frame[0] & TOGGLE != self._toggle:
            raise SdoAbort(AbortCode.TOGGLE_NOT_ALTERNATED)
        segment, self._data = self._data[:SEGMENT_BYTES], self._data[SEGMENT_BYTES:]
        self.ended = not self._data
        command = self._toggle | SEGMENT_BYTES - len(segment) << 1 | self.ended
        self._toggle ^= TOGGLE
        return [bytes((command,)) + segment.ljust(SEGMENT_BYTES, b"\0")]


class BlockDownload(Transfer):
    """Receives blocks of segments; with `checked` the client sends a CRC at the end."""

    def __init__(self, store: Callable[[bytes], None], size: int | None, checked: bool) -> None:
        self._store = store
        self._size = size
        self._checked = checked
        self._data = bytearray()
        self._sequence = 0
        self._complete = False

    def takes(self, _frame: bytes) -> bool:
        """Return True: a segment's sequence number stands where other frames have their command."""
        return True

    def serve(self, frame: bytes) -> list[bytes]:
        """Acknowledge a block at its last segment; the end of the transfer stores the data."""
        if not self._complete:
            return self._segment(frame)
        if frame[0] & 0xE3 != 0xC1:
            raise SdoAbort(AbortCode.INVALID_COMMAND)
        unused = frame[0] >> 2 & 0x7
        data = bytes(self._data[: len(self._data) - unused])
        if self._size is not None and self._size != len(data):
            raise wrong_length(len(data), self._size)
        if self._checked and crc_hqx(data, 0) != int.from_bytes(frame[1:3], "little"):
            raise SdoAbort(AbortCode.CRC_ERROR)
        self._store(data)
        self.ended = True
        return [b"\xa1".ljust(8, b"\0")]

    def _segment(self, frame: bytes) -> list[bytes]:
        number, last = frame[0] & 0x7F, bool(frame[0] & 0x80)
        if number == 0:
            raise SdoAbort(AbortCode.INVALID_SEQUENCE_NUMBER)
        if number == self._sequence + 1:
            self._sequence = number
            self._data += frame[1:]
            self._complete = last
            if len(self._data) > LARGEST_BYTES:
                raise SdoAbort(AbortCode.OUT_OF_MEMORY)
        if not last and number < BLOCK_SIZE:
            return []
        acknowledged, self._sequence = self._sequence, 0
        return [bytes((0xA2, acknowledged, BLOCK_SIZE)).ljust(8, b"\0")]


class BlockUpload(Transfer):
    """Sends blocks of segments, each from the last acknowledged one on; with `checked` a CRC at the end."""

    def __init__(self, data: bytes, block_size: int, checked: bool) -> None:
        self._data = data
        self._block_size = block_size
        self._checked = checked
        self._acknowledged = 0  # segments of the whole transfer
        self._sent = 0  # segments of the present block
        self._complete = False

    def takes(self, frame: bytes) -> bool:
        """Return whether the frame belongs to a block upload, other than the initiate of a new one."""
        return frame[0] >> 5 == BLOCK_UPLOAD and bool(frame[0] & 0x3)

    def serve(self, frame: bytes) -> list[bytes]:
        """Send the first block at the start, the next at an acknowledgement, nothing at the end."""
        step = frame[0] & 0x3
        if step == 1 and self._complete:
            self.ended = True
            return []
        if step == 3 and not self._sent:
            return self._block()
        if step == 2 and self._sent and not self._complete:
            return self._acknowledge(frame)
        raise SdoAbort(AbortCode.INVALID_COMMAND)

    def _block(self) -> list[bytes]:
        total = -(-len(self._data) // SEGMENT_BYTES)
        self._sent = min(self._block_size, total - self._acknowledged)
        frames = []
        for number in range(1, self._sent + 1):
            place = self._acknowledged + number
            last = 0x80 if place == total else 0
            segment = self._data[SEGMENT_BYTES * (place - 1) : SEGMENT_BYTES * place]
            frames.append(bytes((number | last,)) + segment.ljust(SEGMENT_BYTES, b"\0"))
        return frames

    def _acknowledge(self, frame: bytes) -> list[bytes]:
        """Return the next block, or the end with the CRC."""
        received, block_size = frame[1], frame[2]
        if received > self._sent:
            raise SdoAbort(AbortCode.INVALID_SEQUENCE_NUMBER)
        check_block_size(block_size)
        self._acknowledged += received
        self._block_size = block_size
        unused = SEGMENT_BYTES * self._acknowledged - len(self._data)
        if unused < 0:
            return self._block()
        self._complete = True
        crc = crc_hqx(self._data, 0) if self._checked else 0
        return [bytes((0xC1 | unused << 2, *crc.to_bytes(2, "little"))).ljust(8, b"\0")]


def check_block_size(segments: int) -> None:
    """Raise SdoAbort for a block that CiA 301 does not allow."""
    if not 1 <= segments <= BLOCK_SIZE:
        raise SdoAbort(AbortCode.INVALID_BLOCK_SIZE)
