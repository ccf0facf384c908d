"""SDO server with block transfer (CiA 301, 7.2.4): canopen's server refuses block download and has no block upload.

Expedited and segmented transfers stay canopen's. A transfer is one small object; a frame that does not fit the
transfer in progress aborts it, and a new initiate always replaces it.
"""

from __future__ import annotations

import logging
import struct
from binascii import crc_hqx
from typing import TYPE_CHECKING, Any

from canopen.sdo import SdoServer
from canopen.sdo.exceptions import SdoAbortedError

from hil_sim.node import abort_codes
from hil_sim.node.abort_codes import abort

if TYPE_CHECKING:
    from collections.abc import Callable

logger = logging.getLogger(__name__)

BLOCK_SIZE = 127  # segments per block we ask for
LARGEST_BYTES = 1 << 20  # of a download: bounds the memory a client can take

INITIATE = struct.Struct("<BHB")
DOWNLOAD_SEGMENT, DOWNLOAD, UPLOAD, UPLOAD_SEGMENT, ABORTED, BLOCK_UPLOAD, BLOCK_DOWNLOAD = range(7)


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
        """Take one segment; return the acknowledgement when the block is over."""
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


class BlockSdoServer(SdoServer):  # type: ignore[misc]  # canopen ships no types
    """Server of one node; `on_request` takes every frame of its receive identifier, `send` puts the answer out."""

    def __init__(self, dictionary: Any, send: Callable[[int, bytes], None]) -> None:
        super().__init__(0x600 + dictionary.id, 0x580 + dictionary.id, dictionary)
        self._send = send
        self._index = self._subindex = 0
        self._expected: int | None = None  # bytes announced by a segmented download
        self._segments: int | None = None  # DOWNLOAD_SEGMENT or UPLOAD_SEGMENT while such a transfer runs
        self._download: BlockDownload | None = None
        self._upload: BlockUpload | None = None
        self._initiators: dict[int, Callable[[bytes], None]] = {
            DOWNLOAD: self._initiate_download,
            UPLOAD: self._initiate_upload,
            BLOCK_DOWNLOAD: self._initiate_block_download,
            BLOCK_UPLOAD: self._initiate_block_upload,
        }

    def on_request(self, can_id: int, data: bytes, timestamp: float) -> None:  # noqa: ARG002  # canopen's signature
        """Serve one frame; whatever goes wrong becomes an abort on the bus."""
        if len(data) != 8:
            return
        frame = bytes(data)
        try:
            if not self._continue_block(frame):
                self._serve(frame)
        except SdoAbortedError as refusal:
            self._drop()
            self.abort(refusal.code)
        except Exception:
            logger.exception("SDO request %s of node 0x%X", frame.hex(), self.rx_cobid - 0x600)
            self._drop()
            self.abort(abort_codes.GENERAL_ERROR)

    def send_response(self, response: bytes) -> None:
        """Answer the client."""
        self._send(self.tx_cobid, bytes(response))

    def _drop(self) -> None:
        self._segments = self._download = self._upload = None

    def _serve(self, frame: bytes) -> None:
        specifier = frame[0] >> 5
        if specifier == ABORTED:
            self._drop()
            self.request_aborted(frame)
        elif specifier in {DOWNLOAD_SEGMENT, UPLOAD_SEGMENT}:
            if specifier != self._segments:
                raise abort(abort_codes.INVALID_COMMAND)
            self._continue_segments(specifier, frame)
        elif specifier in self._initiators:
            self._drop()
            self._buffer = None
            _, self._index, self._subindex = INITIATE.unpack_from(frame)
            self._initiators[specifier](frame)
        else:
            raise abort(abort_codes.INVALID_COMMAND)

    def _continue_segments(self, specifier: int, frame: bytes) -> None:
        if specifier == UPLOAD_SEGMENT:
            self.segmented_upload(frame[0])
            if not self._buffer:
                self._segments = None
            return
        received = len(self._buffer) + 7 - (frame[0] >> 1 & 0x7)
        last = bool(frame[0] & 1)
        if self._expected is not None and (
            received > self._expected or (last and received != self._expected)
        ):
            raise abort(abort_codes.LENGTH_MISMATCH)
        if received > LARGEST_BYTES:
            raise abort(abort_codes.OUT_OF_MEMORY)
        self.segmented_download(frame[0], frame)
        if last:
            self._segments = None

    def _initiate_upload(self, frame: bytes) -> None:
        self.init_upload(frame)
        if self._buffer:
            self._segments = UPLOAD_SEGMENT

    def _initiate_download(self, frame: bytes) -> None:
        self._node.check_writable(self._index, self._subindex)
        self.init_download(frame)
        if not frame[0] & 0x2:
            self._expected = int.from_bytes(frame[4:8], "little") if frame[0] & 0x1 else None
            self._segments = DOWNLOAD_SEGMENT

    def _initiate_block_download(self, frame: bytes) -> None:
        if frame[0] & 0x1:
            raise abort(abort_codes.INVALID_COMMAND)
        self._node.check_writable(self._index, self._subindex)
        size = int.from_bytes(frame[4:8], "little") if frame[0] & 0x2 else None
        self._download = BlockDownload(self._index, self._subindex, size, bool(frame[0] & 0x4))
        self.send_response(INITIATE.pack(0xA4, self._index, self._subindex) + bytes((BLOCK_SIZE, 0, 0, 0)))

    def _initiate_block_upload(self, frame: bytes) -> None:
        if frame[0] & 0x3:
            raise abort(abort_codes.INVALID_COMMAND)
        if not 1 <= frame[4] <= 127:
            raise abort(abort_codes.INVALID_BLOCK_SIZE)
        data = bytes(self._node.get_data(self._index, self._subindex, check_readable=True))
        if not data:
            raise abort(abort_codes.NO_DATA)
        self._upload = BlockUpload(data, frame[4], bool(frame[0] & 0x4))
        self.send_response(struct.pack("<BHBL", 0xC6, self._index, self._subindex, len(data)))

    def _continue_block(self, frame: bytes) -> bool:
        """Take `frame` if it belongs to a block transfer in progress."""
        if frame[0] == ABORTED << 5:  # sequence number 0 is no segment either
            return False
        if self._download is not None:
            self._receive(self._download, frame)
            return True
        if self._upload is not None and frame[0] >> 5 == BLOCK_UPLOAD and frame[0] & 0x3:
            self._transmit(self._upload, frame)
            return True
        return False

    def _receive(self, transfer: BlockDownload, frame: bytes) -> None:
        if not transfer.finished:
            reply = transfer.segment(frame)
            if reply is not None:
                self.send_response(reply)
            return
        if frame[0] & 0xE3 != 0xC1:
            raise abort(abort_codes.INVALID_COMMAND)
        data = transfer.end(frame)
        self._node.set_data(*transfer.address, data, check_writable=True)
        self._drop()
        self.send_response(bytes((0xA1, 0, 0, 0, 0, 0, 0, 0)))

    def _transmit(self, transfer: BlockUpload, frame: bytes) -> None:
        step = frame[0] & 0x3
        if step == 1 and transfer.ended:
            self._drop()
        elif step == 3 and not transfer.sent:
            for segment in transfer.block():
                self.send_response(segment)
        elif step == 2 and transfer.sent and not transfer.ended:
            for reply in transfer.acknowledge(frame):
                self.send_response(reply)
        else:
            raise abort(abort_codes.INVALID_COMMAND)
