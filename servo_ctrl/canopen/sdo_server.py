"""SDO server of our own node: expedited, segmented and block transfer (CiA 301, section 7.2.4).

There is one transfer at a time. A frame that does not fit it aborts it, and a new initiate replaces it. An
abandoned transfer does no harm: nothing is written before its last segment, and the entry bounds its size. A
block download, which would take any other frame for a segment, is given up when its client is silent. While
SYNC runs, the segments of a block upload leave a few a cycle: 127 at once would delay the cycle by 16 ms.
"""

import struct
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from servo_ctrl.canopen.dictionary import Dictionary
from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.canopen.sdo_blocks import MOST_SEGMENTS, BlockDownload, BlockUpload

FRAME = 8
INITIATE = struct.Struct("<BHBI")
EXPEDITED, SIZED, LAST, TOGGLE = 0x02, 0x01, 0x01, 0x10
DOWNLOAD_SEGMENT, DOWNLOAD, UPLOAD, UPLOAD_SEGMENT, ABORTED, BLOCK_UPLOAD, BLOCK_DOWNLOAD = range(7)
"""Client command specifiers: the upper three bits of a request's first byte."""
INITIATES = (DOWNLOAD, UPLOAD, BLOCK_UPLOAD, BLOCK_DOWNLOAD)
UPLOAD_ANSWER, DOWNLOAD_ANSWER, DOWNLOAD_SEGMENT_ANSWER, ABORT = 0x40, 0x60, 0x20, 0x80
SEGMENT = 7
"""Bytes that a segment carries."""
WITH_CRC, BLOCK_SIZED = 0x04, 0x02
"""Bits of the initiate of a block transfer."""
BLOCK_TIMEOUT_S = 1.0
"""Time from our last frame, monotonic clock, after which a block transfer is given up; chosen."""
INITIATE_MASK = {BLOCK_UPLOAD: 0x03, BLOCK_DOWNLOAD: 0x01}
"""Bits of the subcommand, which are 0 in the initiate of a block transfer."""
NO_ADDRESS = (0, 0)
"""Multiplexer of an abort that belongs to no transfer."""


class Transfer(NamedTuple):
    """A segmented transfer in progress."""

    specifier: int
    """UPLOAD_SEGMENT or DOWNLOAD_SEGMENT: the specifier that the client must continue with."""
    data: bytes
    """Remaining data of an upload, received data of a download."""
    size: int
    """Size of a download as announced by the client, else that of the entry."""
    toggle: int


class SdoServer:
    """Serves `dictionary`: `on_request` receives each frame of 600h + node id, `send` sends the answer.

    `paced`: the segments of a block upload wait for `send_waiting`; else they are sent at once.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        send: Callable[[bytes], None],
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._dictionary, self._send, self._now_s = dictionary, send, now_s
        self.paced = False
        self._address = NO_ADDRESS
        self._transfer: Transfer | None = None
        self._block: BlockUpload | BlockDownload | None = None
        self._timed_out = False
        """The block transfer of `_address` has timed out, unknown to its client."""
        self._last_frame_s = 0.0

    def on_request(self, _can_id: int, payload: bytes | bytearray, _timestamp_s: float) -> None:
        """Answer one frame. A frame of another length than eight bytes is no SDO and gets no answer."""
        if len(payload) != FRAME:
            return
        frame = bytes(payload)
        try:
            answer = self._in_block(frame)
            if answer is None:
                answer = self._serve(frame)
        except SdoAbort as refusal:
            answer = INITIATE.pack(ABORT, *self._address, refusal.code)
            self.forget()
        if self._transfer is None and self._block is None:
            self.forget()
        if answer:
            self._send(answer)
        self._last_frame_s = self._now_s()
        if not self.paced:
            self.send_waiting(MOST_SEGMENTS)

    def send_waiting(self, count: int) -> None:
        """Send at most `count` of the segments that wait in a block upload."""
        block = self._block
        if isinstance(block, BlockUpload) and block.waiting:
            for _ in range(min(count, len(block.waiting))):
                self._send(block.waiting.popleft())
            self._last_frame_s = self._now_s()

    def forget(self) -> None:
        """Drop the transfer in progress."""
        self._transfer = self._block = None
        self._timed_out, self._address = False, NO_ADDRESS

    def _serve(self, frame: bytes) -> bytes:
        specifier = frame[0] >> 5
        if specifier == ABORTED:
            self.forget()
            return b""
        if specifier in {UPLOAD_SEGMENT, DOWNLOAD_SEGMENT}:
            transfer = self._transfer
            if transfer is None or transfer.specifier != specifier:
                raise SdoAbort(AbortCode.INVALID_COMMAND)
            if frame[0] & TOGGLE != transfer.toggle:
                raise SdoAbort(AbortCode.TOGGLE_NOT_ALTERNATED)
            upload = specifier == UPLOAD_SEGMENT
            return self._send_segment(transfer) if upload else self._receive_segment(transfer, frame)
        if frame[0] & INITIATE_MASK.get(specifier, 0) or specifier not in INITIATES:
            raise SdoAbort(AbortCode.TIMED_OUT if self._timed_out else AbortCode.INVALID_COMMAND)
        self.forget()
        _, index, subindex, announced = INITIATE.unpack(frame)
        self._address = (index, subindex)
        if specifier == UPLOAD:
            return self._upload(self._dictionary.read(index, subindex))
        if specifier == DOWNLOAD:
            return self._download(frame, announced)
        return (
            self._block_upload(frame) if specifier == BLOCK_UPLOAD else self._block_download(frame, announced)
        )

    def _in_block(self, frame: bytes) -> bytes | None:
        """Continue a block transfer; None if there is none, or the frame does not belong to it."""
        block, silent = self._block, self._now_s() - self._last_frame_s > BLOCK_TIMEOUT_S
        if block is None or silent or frame[0] == ABORT or not block.takes(frame):
            self._timed_out = block is not None and silent
            self._block = None
            return None
        answer = block.serve(frame)
        if block.over:
            self.forget()
        return answer

    def _block_upload(self, frame: bytes) -> bytes:
        data = self._dictionary.read(*self._address)
        if len(data) <= frame[5]:  # protocol switch threshold of the client: a normal upload will do
            return self._upload(data)
        if not data:
            raise SdoAbort(AbortCode.NO_DATA)
        crc = frame[0] & WITH_CRC
        self._block = BlockUpload(data, frame[4], with_crc=bool(crc))
        return INITIATE.pack(0xC0 | BLOCK_SIZED | crc, *self._address, len(data))

    def _block_download(self, frame: bytes, announced: int) -> bytes:
        wanted = self._dictionary.writable_size(*self._address)
        if frame[0] & BLOCK_SIZED:
            _check_size(announced, wanted)
        crc = frame[0] & WITH_CRC
        write = partial(self._write, wanted=wanted)
        self._block = BlockDownload(wanted, with_crc=bool(crc), write=write)
        return INITIATE.pack(0xA0 | crc, *self._address, MOST_SEGMENTS)

    def _upload(self, data: bytes) -> bytes:
        if not data:
            raise SdoAbort(AbortCode.NO_DATA)
        if len(data) <= 4:
            command = UPLOAD_ANSWER | EXPEDITED | SIZED | 4 - len(data) << 2
            return INITIATE.pack(command, *self._address, int.from_bytes(data, "little"))
        self._transfer = Transfer(UPLOAD_SEGMENT, data, len(data), 0)
        return INITIATE.pack(UPLOAD_ANSWER | SIZED, *self._address, len(data))

    def _send_segment(self, transfer: Transfer) -> bytes:
        data, remaining = transfer.data[:SEGMENT], transfer.data[SEGMENT:]
        if remaining:
            self._transfer = transfer._replace(data=remaining, toggle=transfer.toggle ^ TOGGLE)
        else:
            self.forget()
        command = transfer.toggle | SEGMENT - len(data) << 1 | (0 if remaining else LAST)
        return bytes((command,)) + data.ljust(SEGMENT, b"\0")

    def _download(self, frame: bytes, announced: int) -> bytes:
        """Begin a download; complete it if it is expedited."""
        wanted = self._dictionary.writable_size(*self._address)
        if frame[0] & EXPEDITED:
            size = 4 - (frame[0] >> 2 & 0x03) if frame[0] & SIZED else min(wanted, 4)
            self._write(frame[4 : 4 + size], wanted)
        else:
            size = announced if frame[0] & SIZED else wanted
            _check_size(size, wanted)
            self._transfer = Transfer(DOWNLOAD_SEGMENT, b"", size, 0)
        return INITIATE.pack(DOWNLOAD_ANSWER, *self._address, 0)

    def _receive_segment(self, transfer: Transfer, frame: bytes) -> bytes:
        data = transfer.data + frame[1 : FRAME - (frame[0] >> 1 & 0x07)]
        if len(data) > transfer.size:
            raise SdoAbort(AbortCode.TOO_LONG)
        if frame[0] & LAST:
            self._write(data, transfer.size)
            self.forget()
        else:
            self._transfer = transfer._replace(data=data, toggle=transfer.toggle ^ TOGGLE)
        return bytes((DOWNLOAD_SEGMENT_ANSWER | transfer.toggle,)).ljust(FRAME, b"\0")

    def _write(self, data: bytes, wanted: int) -> None:
        _check_size(len(data), wanted)
        self._dictionary.write(*self._address, data)


def _check_size(size: int, wanted: int) -> None:
    if size != wanted:
        raise SdoAbort(AbortCode.TOO_LONG if size > wanted else AbortCode.TOO_SHORT)
