"""SDO server with block transfer, which canopen's own server lacks.

Expedited and segmented transfers stay canopen's. A frame that does not fit the transfer in progress aborts
it, and a new initiate always replaces it. The transfer of a client that falls silent is abandoned, by the
wall clock as clients time out by it: a block download left open would take the next client's requests.
"""

import logging
import struct
import time
from collections.abc import Callable
from typing import Any

from canopen.sdo.exceptions import SdoAbortedError
from canopen.sdo.server import SdoServer

from hil_sim.node import abort_codes
from hil_sim.node.abort_codes import abort
from hil_sim.node.sdo_block import BLOCK_SIZE, LARGEST_BYTES, BlockDownload, BlockUpload

logger = logging.getLogger(__name__)

TRANSFER_TIMEOUT_S = 1.0  # longest time between two frames of a transfer
INITIATE = struct.Struct("<BHB")
CRC_SUPPORTED = 0x4  # answered only to a client that supports it: some check whenever the server does
DOWNLOAD_SEGMENT, DOWNLOAD, UPLOAD, UPLOAD_SEGMENT, ABORTED, BLOCK_UPLOAD, BLOCK_DOWNLOAD = range(7)


class BlockSdoServer(SdoServer):
    """Server of one node: `on_request` receives the frames of its identifier, `send` sends the answers."""

    def __init__(self, dictionary: Any, send: Callable[[int, bytes], None]) -> None:
        super().__init__(0x600 + dictionary.node_id, 0x580 + dictionary.node_id, dictionary)
        self._send = send
        self.now_s: Callable[[], float] = time.monotonic
        self._last_frame_s = 0.0
        self._index: int = 0
        self._subindex: int = 0
        self._buffer: bytearray | None = None
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
        """Serve one frame; an error becomes an abort on the bus."""
        if len(data) != 8:
            return
        frame = bytes(data)
        before_s, self._last_frame_s = self._last_frame_s, self.now_s()
        if self._last_frame_s - before_s > TRANSFER_TIMEOUT_S:
            self.abandon_transfer()
        try:
            if not self._continue_block(frame):
                self._serve(frame)
        except SdoAbortedError as refusal:
            self.abandon_transfer()
            self.abort(refusal.code)
        except Exception:  # a defect must not leave the client waiting: it is logged and aborted
            logger.exception("SDO request %s of node 0x%X", frame.hex(), self.rx_cobid - 0x600)
            self.abandon_transfer()
            self.abort(abort_codes.GENERAL_ERROR)

    def send_response(self, response: bytes) -> None:
        """Answer the client."""
        self._send(self.tx_cobid, bytes(response))

    def abandon_transfer(self) -> None:
        """Abandon the transfer in progress; the client has to start again."""
        self._segments = self._download = self._upload = None

    def _serve(self, frame: bytes) -> None:
        specifier = frame[0] >> 5
        if specifier == ABORTED:
            self.abandon_transfer()
            self.request_aborted(frame)
        elif specifier in {DOWNLOAD_SEGMENT, UPLOAD_SEGMENT}:
            if specifier != self._segments:
                raise abort(abort_codes.INVALID_COMMAND)
            self._continue_segments(specifier, frame)
        elif specifier in self._initiators:
            self.abandon_transfer()
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
        received = len(self._buffer or b"") + 7 - (frame[0] >> 1 & 0x7)
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
        checked = frame[0] & CRC_SUPPORTED
        self._download = BlockDownload(self._index, self._subindex, size, bool(checked))
        answer = INITIATE.pack(0xA0 | checked, self._index, self._subindex)
        self.send_response(answer + bytes((BLOCK_SIZE, 0, 0, 0)))

    def _initiate_block_upload(self, frame: bytes) -> None:
        if frame[0] & 0x3:
            raise abort(abort_codes.INVALID_COMMAND)
        if not 1 <= frame[4] <= 127:
            raise abort(abort_codes.INVALID_BLOCK_SIZE)
        data = bytes(self._node.get_data(self._index, self._subindex, check_readable=True))
        if not data:
            raise abort(abort_codes.NO_DATA)
        checked = frame[0] & CRC_SUPPORTED
        self._upload = BlockUpload(data, frame[4], bool(checked))
        self.send_response(struct.pack("<BHBL", 0xC2 | checked, self._index, self._subindex, len(data)))

    def _continue_block(self, frame: bytes) -> bool:
        """Serve `frame` if it belongs to a block transfer in progress; return whether it did."""
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
        self.abandon_transfer()
        self.send_response(bytes((0xA1, 0, 0, 0, 0, 0, 0, 0)))

    def _transmit(self, transfer: BlockUpload, frame: bytes) -> None:
        step = frame[0] & 0x3
        if step == 1 and transfer.ended:
            self.abandon_transfer()
        elif step == 3 and not transfer.sent:
            for segment in transfer.block():
                self.send_response(segment)
        elif step == 2 and transfer.sent and not transfer.ended:
            for reply in transfer.acknowledge(frame):
                self.send_response(reply)
        else:
            raise abort(abort_codes.INVALID_COMMAND)
