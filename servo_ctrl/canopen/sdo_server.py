"""SDO server of our own node: expedited, segmented and block transfer (CiA 301, section 7.2.4).

There is one transfer at a time. A frame that does not fit it aborts it, and a new initiate replaces it. An
abandoned transfer does no harm: nothing is written before its last segment, and the entry bounds its size. A
block download, which would take any other frame for a segment, ends when its client is silent. While SYNC
runs, the server sends a few segments of a block upload per cycle: 127 at once would delay the cycle by 16 ms.
"""

import struct
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from servo_ctrl.canopen.dictionary import Dictionary
from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.canopen.sdo_blocks import SEGMENT_BYTES, SEGMENTS_MAX, BlockDownload, BlockUpload

FRAME_BYTES = 8
INITIATE = struct.Struct("<BHBI")
EXPEDITED, SIZED, LAST, TOGGLE = 0x02, 0x01, 0x01, 0x10
DOWNLOAD_SEGMENT, DOWNLOAD, UPLOAD, UPLOAD_SEGMENT, ABORT_TRANSFER, BLOCK_UPLOAD, BLOCK_DOWNLOAD = range(7)
"""Client command specifiers: the upper three bits of a request's first byte."""
INITIATES = (DOWNLOAD, UPLOAD, BLOCK_UPLOAD, BLOCK_DOWNLOAD)
UPLOAD_RESPONSE, DOWNLOAD_RESPONSE, DOWNLOAD_SEGMENT_RESPONSE, ABORT = 0x40, 0x60, 0x20, 0x80
WITH_CRC, BLOCK_SIZED = 0x04, 0x02
"""Bits of the initiate of a block transfer."""
BLOCK_TIMEOUT_S = 1.0
"""Time from our last frame, monotonic clock, after which a block transfer times out; chosen."""
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
    """Serves `dictionary`: `on_request` receives each frame of 600h + node id, `send` sends the response.

    `paced`: the segments of a block upload wait for `send_pending`; else they are sent at once.
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
        """Respond to one frame. A frame that has not eight bytes is not an SDO and gets no response."""
        if len(payload) != FRAME_BYTES:
            return
        frame = bytes(payload)
        try:
            response = self._continue_block(frame)
            if response is None:
                response = self._serve(frame)
        except SdoAbort as refusal:
            response = INITIATE.pack(ABORT, *self._address, refusal.code)
            self.drop_transfer()
        if self._transfer is None and self._block is None:
            self.drop_transfer()
        if response:
            self._send(response)
        self._last_frame_s = self._now_s()
        if not self.paced:
            self.send_pending(SEGMENTS_MAX)

    def send_pending(self, count: int) -> None:
        """Send at most `count` of the pending segments of a block upload."""
        block = self._block
        if isinstance(block, BlockUpload) and block.pending:
            for _ in range(min(count, len(block.pending))):
                self._send(block.pending.popleft())
            self._last_frame_s = self._now_s()

    def drop_transfer(self) -> None:
        """Drop the transfer in progress."""
        self._transfer = self._block = None
        self._timed_out, self._address = False, NO_ADDRESS

    def _serve(self, frame: bytes) -> bytes:
        specifier = frame[0] >> 5
        if specifier == ABORT_TRANSFER:
            self.drop_transfer()
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
        self.drop_transfer()
        _, index, subindex, announced = INITIATE.unpack(frame)
        self._address = (index, subindex)
        if specifier == UPLOAD:
            return self._upload(self._dictionary.read(index, subindex))
        if specifier == DOWNLOAD:
            return self._download(frame, announced)
        return (
            self._block_upload(frame) if specifier == BLOCK_UPLOAD else self._block_download(frame, announced)
        )

    def _continue_block(self, frame: bytes) -> bytes | None:
        """Continue a block transfer; None if there is none, or the frame does not belong to it."""
        block, timed_out = self._block, self._now_s() - self._last_frame_s > BLOCK_TIMEOUT_S
        if block is None or timed_out or frame[0] == ABORT or not block.accepts(frame):
            self._timed_out = block is not None and timed_out
            self._block = None
            return None
        response = block.serve(frame)
        if block.finished:
            self.drop_transfer()
        return response

    def _block_upload(self, frame: bytes) -> bytes:
        data = self._dictionary.read(*self._address)
        if len(data) <= frame[5]:  # protocol switch threshold of the client: it accepts a normal upload
            return self._upload(data)
        if not data:
            raise SdoAbort(AbortCode.NO_DATA)
        crc = frame[0] & WITH_CRC
        self._block = BlockUpload(data, frame[4], with_crc=bool(crc))
        return INITIATE.pack(0xC0 | BLOCK_SIZED | crc, *self._address, len(data))

    def _block_download(self, frame: bytes, announced: int) -> bytes:
        entry_size = self._dictionary.writable_size(*self._address)
        if frame[0] & BLOCK_SIZED:
            _check_size(announced, entry_size)
        crc = frame[0] & WITH_CRC
        write = partial(self._write, entry_size=entry_size)
        self._block = BlockDownload(entry_size, with_crc=bool(crc), write=write)
        return INITIATE.pack(0xA0 | crc, *self._address, SEGMENTS_MAX)

    def _upload(self, data: bytes) -> bytes:
        if not data:
            raise SdoAbort(AbortCode.NO_DATA)
        if len(data) <= 4:
            command = UPLOAD_RESPONSE | EXPEDITED | SIZED | 4 - len(data) << 2
            return INITIATE.pack(command, *self._address, int.from_bytes(data, "little"))
        self._transfer = Transfer(UPLOAD_SEGMENT, data, len(data), 0)
        return INITIATE.pack(UPLOAD_RESPONSE | SIZED, *self._address, len(data))

    def _send_segment(self, transfer: Transfer) -> bytes:
        data, remaining = transfer.data[:SEGMENT_BYTES], transfer.data[SEGMENT_BYTES:]
        if remaining:
            self._transfer = transfer._replace(data=remaining, toggle=transfer.toggle ^ TOGGLE)
        else:
            self.drop_transfer()
        command = transfer.toggle | SEGMENT_BYTES - len(data) << 1 | (0 if remaining else LAST)
        return bytes((command,)) + data.ljust(SEGMENT_BYTES, b"\0")

    def _download(self, frame: bytes, announced: int) -> bytes:
        """Begin a download; complete it if it is expedited."""
        entry_size = self._dictionary.writable_size(*self._address)
        if frame[0] & EXPEDITED:
            size = 4 - (frame[0] >> 2 & 0x03) if frame[0] & SIZED else min(entry_size, 4)
            self._write(frame[4 : 4 + size], entry_size)
        else:
            size = announced if frame[0] & SIZED else entry_size
            _check_size(size, entry_size)
            self._transfer = Transfer(DOWNLOAD_SEGMENT, b"", size, 0)
        return INITIATE.pack(DOWNLOAD_RESPONSE, *self._address, 0)

    def _receive_segment(self, transfer: Transfer, frame: bytes) -> bytes:
        data = transfer.data + frame[1 : FRAME_BYTES - (frame[0] >> 1 & 0x07)]
        if len(data) > transfer.size:
            raise SdoAbort(AbortCode.TOO_LONG)
        if frame[0] & LAST:
            self._write(data, transfer.size)
            self.drop_transfer()
        else:
            self._transfer = transfer._replace(data=data, toggle=transfer.toggle ^ TOGGLE)
        return bytes((DOWNLOAD_SEGMENT_RESPONSE | transfer.toggle,)).ljust(FRAME_BYTES, b"\0")

    def _write(self, data: bytes, entry_size: int) -> None:
        _check_size(len(data), entry_size)
        self._dictionary.write(*self._address, data)


def _check_size(size: int, entry_size: int) -> None:
    if size != entry_size:
        raise SdoAbort(AbortCode.TOO_LONG if size > entry_size else AbortCode.TOO_SHORT)
