"""SDO server of one node: expedited, segmented and block transfers, one at a time (CiA 301, 7.2.4).

A frame that does not fit the transfer in progress aborts it, and a new initiate always replaces it. A
transfer whose client sends nothing more times out, by the wall clock, as clients do: an open block download
would take the requests of the next client for its segments. The time-out starts with the last frame of our
answer, so it is longer by the time that the answer may take on the slowest bus.
"""

import logging
import struct
import time
from collections.abc import Callable

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.sdo_abort import AbortCode, SdoAbort
from hil_sim.node.sdo_transfers import (
    BLOCK_SIZE,
    BLOCK_UPLOAD,
    BlockDownload,
    BlockUpload,
    SegmentedDownload,
    SegmentedUpload,
    Transfer,
    check_block_size,
)

logger = logging.getLogger(__name__)

TRANSFER_TIMEOUT_S = 1.0
"""Longest time between two frames of a transfer (chosen: longer than the time-out of our clients)."""
SLOWEST_FRAME_S = 0.0135
"""A frame of eight bytes with all its stuff bits, 135 bits, at 10 kbit/s, the slowest rate of CiA 301."""
NO_ADDRESS = (0, 0)
"""Multiplexer of an abort that belongs to no transfer."""
FRAME_BYTES = 8
INITIATE = struct.Struct("<BHBI")
"""Command, index, subindex, and four bytes of data, a size or an abort code."""
EXPEDITED, SIZED = 0x2, 0x1
BLOCK_SIZED = 0x2
CRC_SUPPORTED = 0x4
"""The server confirms it only to a client that supports it: some clients check whenever it is set."""
DOWNLOAD, UPLOAD, ABORTED, BLOCK_DOWNLOAD = 1, 2, 4, 6
"""Client command specifiers: the upper three bits of a frame's first byte."""
INITIATE_MASK = {BLOCK_DOWNLOAD: 0x1, BLOCK_UPLOAD: 0x3}
"""Bits of the subcommand, which are 0 in the initiate of a block transfer."""


class SdoServer:
    """Serves the requests of identifier `request_id` on `dictionary`; `send(can_id, data)` sends answers."""

    def __init__(self, dictionary: Dictionary, send: Callable[[int, bytes], None]) -> None:
        self.now_s: Callable[[], float] = time.monotonic
        self._dictionary = dictionary
        self._send = send
        self._last_frame_s = 0.0
        self._timeout_s = TRANSFER_TIMEOUT_S
        self._address = NO_ADDRESS  # of the transfer in progress
        self._timed_out = False  # the transfer of `_address` has timed out, unknown to its client
        self._transfer: Transfer | None = None

    @property
    def request_id(self) -> int:
        """Identifier of the requests."""
        return 0x600 + self._dictionary.node_id

    def on_request(self, frame: bytes) -> None:
        """Serve one frame; an error becomes an abort on the bus."""
        if len(frame) != FRAME_BYTES:
            return
        before_s, self._last_frame_s = self._last_frame_s, self.now_s()
        if self._transfer is not None and self._last_frame_s - before_s > self._timeout_s:
            self._transfer, self._timed_out = None, True
        try:
            answers = self._serve(frame)
        except SdoAbort as refusal:
            answers = self._abort(refusal.code)
        except Exception:  # a defect must not leave the client waiting: it is logged and aborted
            logger.exception("SDO request %s of node %d", frame.hex(), self._dictionary.node_id)
            answers = self._abort(AbortCode.GENERAL_ERROR)
        if self._transfer is None:
            self.abandon_transfer()
        self._timeout_s = TRANSFER_TIMEOUT_S + SLOWEST_FRAME_S * len(answers)
        for answer in answers:
            self._send(0x580 + self._dictionary.node_id, answer)

    def abandon_transfer(self) -> None:
        """Abandon the transfer in progress; the client has to start again."""
        self._transfer = None
        self._timed_out = False
        self._address = NO_ADDRESS

    def _abort(self, code: AbortCode) -> list[bytes]:
        answer = INITIATE.pack(ABORTED << 5, *self._address, code)
        self.abandon_transfer()
        return [answer]

    def _serve(self, frame: bytes) -> list[bytes]:
        transfer = self._transfer
        if transfer is not None and frame[0] != ABORTED << 5 and transfer.takes(frame):
            answers = transfer.serve(frame)
            if transfer.ended:
                self.abandon_transfer()
            return answers
        specifier = frame[0] >> 5
        if specifier == ABORTED:
            self.abandon_transfer()
            return []
        initiates = specifier in {DOWNLOAD, UPLOAD} or (
            specifier in {BLOCK_DOWNLOAD, BLOCK_UPLOAD} and not frame[0] & INITIATE_MASK[specifier]
        )
        if not initiates:  # it continues a transfer that has ended, or that does not accept it
            raise SdoAbort(AbortCode.TIMED_OUT if self._timed_out else AbortCode.INVALID_COMMAND)
        self.abandon_transfer()
        command, index, subindex, number = INITIATE.unpack(frame)
        self._address = (index, subindex)
        if specifier == DOWNLOAD:
            return self._download(command, number, frame[4:])
        if specifier == UPLOAD:
            return self._upload()
        if specifier == BLOCK_DOWNLOAD:
            return self._block_download(command, number)
        return self._block_upload(command, frame[4])

    def _download(self, command: int, size: int, data: bytes) -> list[bytes]:
        self._dictionary.check_writable(*self._address)
        if command & EXPEDITED:
            self._store(data[: 4 - (command >> 2 & 0x3)] if command & SIZED else data)
        else:
            self._transfer = SegmentedDownload(self._store, size if command & SIZED else None)
        return [INITIATE.pack(0x60, *self._address, 0)]

    def _upload(self) -> list[bytes]:
        data = self._data()
        if len(data) <= 4:
            command = 0x43 | 4 - len(data) << 2
            return [INITIATE.pack(command, *self._address, int.from_bytes(data, "little"))]
        self._transfer = SegmentedUpload(data)
        return [INITIATE.pack(0x41, *self._address, len(data))]

    def _block_download(self, command: int, size: int) -> list[bytes]:
        self._dictionary.check_writable(*self._address)
        checked = command & CRC_SUPPORTED
        self._transfer = BlockDownload(self._store, size if command & BLOCK_SIZED else None, bool(checked))
        return [INITIATE.pack(0xA0 | checked, *self._address, BLOCK_SIZE)]

    def _block_upload(self, command: int, block_size: int) -> list[bytes]:
        check_block_size(block_size)
        data = self._data()
        checked = command & CRC_SUPPORTED
        self._transfer = BlockUpload(data, block_size, bool(checked))
        return [INITIATE.pack(0xC2 | checked, *self._address, len(data))]

    def _data(self) -> bytes:
        """Return the data of an upload. Raises SdoAbort where they are empty: no upload transfers nothing."""
        self._dictionary.check_readable(*self._address)
        data = self._dictionary.get_data(*self._address)
        if not data:
            raise SdoAbort(AbortCode.NO_DATA)
        return data

    def _store(self, data: bytes) -> None:
        self._dictionary.set_data(*self._address, data)
