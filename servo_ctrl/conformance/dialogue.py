"""Raw dialogues with one node: frames out, frames in, every wait bounded.

SDO transfers are made frame by frame (CiA 301, 7.2.4), because a client library would hide what is tested.
"""

import struct
import time
from typing import Protocol

INITIATE = struct.Struct("<BHBI")
FRAME_BYTES, SEGMENT_BYTES = 8, 7
UPLOAD, SEGMENT_UPLOAD, ABORT = 0x40, 0x60, 0x80
TOGGLE, LAST = 0x10, 0x01
RESPONSE_LIMIT_S = 0.5
"""Bounds the wait for the response to a request, wall clock; chosen."""
LATE_RESPONSE_S = 2.0
"""Bounds the further wait for a late response, which would else count for the next request; chosen."""
SILENCE_S = 0.1
"""Time for which the bus is observed for a frame that must not arrive; chosen."""
SEGMENTS_MAX = 1 << 17
"""Bounds an upload, whatever size the node announces; chosen."""


class Failed(Exception):  # noqa: N818  # a verdict on the node, no error of the program
    """The node does not meet the clause; the text gives the reason."""


class NotApplicable(Exception):  # noqa: N818  # the same
    """The node lacks what the clause is about."""


class Refused(Exception):  # noqa: N818  # an answer of the node
    """An SDO abort: its `code`."""

    def __init__(self, code: int) -> None:
        self.code = code
        super().__init__(f"refused with {code:08X}h")


class Wire(Protocol):
    """Interface to the bus."""

    def send(self, can_id: int, data: bytes) -> None:
        """Send a frame."""

    def receive(self, timeout_s: float) -> tuple[int, bytes] | None:
        """Return the next frame; None when none arrives in time."""


class Dialogue:
    """Requests to the node `node_id` on `wire`, and its answers."""

    def __init__(self, wire: Wire, node_id: int) -> None:
        self.node_id = node_id
        self._wire = wire

    def send(self, can_id: int, data: bytes = b"") -> None:
        """Send a frame."""
        self._wire.send(can_id, data)

    def command(self, specifier: int, node_id: int | None = None) -> None:
        """Send an NMT command to this node, or to another."""
        self.send(0x000, bytes((specifier, self.node_id if node_id is None else node_id)))

    def wait_for(self, can_id: int, timeout_s: float = RESPONSE_LIMIT_S) -> bytes | None:
        """Return the next frame of a CAN-ID; None when none arrives in time. Other frames are dropped."""
        ends_s = time.monotonic() + timeout_s
        while (left_s := ends_s - time.monotonic()) > 0.0:
            frame = self._wire.receive(left_s)
            if frame is None:
                return None
            if frame[0] == can_id:
                return frame[1]
        return None

    def drop_arrived(self) -> None:
        """Drop frames that have already arrived."""
        while self._wire.receive(0.0) is not None:
            pass

    def exchange(self, request: bytes) -> bytes:
        """Send an SDO frame and return its answer. Raises Failed unless an answer of eight bytes arrives."""
        self.drop_arrived()
        self.send(0x600 + self.node_id, request)
        answer = self.wait_for(0x580 + self.node_id)
        if answer is None:
            late = self.wait_for(0x580 + self.node_id, LATE_RESPONSE_S) is not None
            arrived = f", but within {RESPONSE_LIMIT_S + LATE_RESPONSE_S:g} s" if late else ""
            raise Failed(f"{request.hex(' ')} was not answered within {RESPONSE_LIMIT_S:g} s{arrived}")
        if len(answer) != FRAME_BYTES:
            raise Failed(f"{request.hex(' ')} was answered by {len(answer)} bytes")
        return answer

    def initiate(self, command: int, index: int, subindex: int, number: int = 0) -> bytes:
        """Begin a transfer. Raises Refused, and Failed for an answer about another object."""
        answer = self.exchange(INITIATE.pack(command, index, subindex, number))
        found, sub = int.from_bytes(answer[1:3], "little"), answer[3]
        if (found, sub) != (index, subindex):
            raise Failed(f"asked for {index:04X}h:{subindex:02X}, answered about {found:04X}h:{sub:02X}")
        return accepted(answer)

    def read(self, index: int, subindex: int = 0) -> bytes:
        """Upload an object, expedited or in segments. Raises Refused, Failed."""
        answer = self.initiate(UPLOAD, index, subindex)
        if answer[0] & 0xE0 != UPLOAD:
            raise Failed(f"an upload was answered by the command {answer[0]:02X}h")
        if answer[0] & 0x02:
            return answer[4 : 8 - (answer[0] >> 2 & 0x3)] if answer[0] & 0x01 else answer[4:]
        data, toggle = b"", 0
        for _ in range(SEGMENTS_MAX):
            segment = accepted(self.exchange(bytes((SEGMENT_UPLOAD | toggle,)).ljust(FRAME_BYTES, b"\0")))
            if segment[0] & 0xF0 != toggle:
                raise Failed(f"segment {len(data) // SEGMENT_BYTES + 1} has the command {segment[0]:02X}h")
            data += segment[1 : 8 - (segment[0] >> 1 & 0x7)]
            toggle ^= TOGGLE
            if segment[0] & LAST:
                break
        announced = int.from_bytes(answer[4:], "little")
        if answer[0] & 0x01 and announced != len(data):
            raise Failed(f"{announced} bytes were announced, {len(data)} sent")
        return data

    def number(self, index: int, subindex: int = 0) -> int:
        """Upload an unsigned number. Raises Refused, Failed."""
        return int.from_bytes(self.read(index, subindex), "little")

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Download at most four bytes. Raises Refused, Failed."""
        command = 0x23 | 4 - len(data) << 2
        answer = self.initiate(command, index, subindex, int.from_bytes(data, "little"))
        if answer[0] != 0x60:
            raise Failed(f"a download was answered by the command {answer[0]:02X}h")

    def refusal(self, request: bytes, *codes: int) -> None:
        """Send an SDO frame that must be aborted with one of the codes. Raises Failed."""
        expect_code(self.exchange(request), *codes)

    def refused_write(self, index: int, subindex: int, data: bytes, *codes: int) -> None:
        """Try a download that must be aborted with one of the codes, if any are given. Raises Failed."""
        try:
            self.write(index, subindex, data)
        except Refused as refusal:
            check_code(refusal.code, *codes)
        else:
            raise Failed(f"{index:04X}h:{subindex:02X} took {data.hex()}")

    def refused_read(self, index: int, subindex: int, *codes: int) -> None:
        """Try an upload that must be aborted, likewise. Raises Failed."""
        try:
            self.read(index, subindex)
        except Refused as refusal:
            check_code(refusal.code, *codes)
        else:
            raise Failed(f"{index:04X}h:{subindex:02X} was sent")

    def silence(self, can_id: int) -> None:
        """Raise Failed if a frame of this CAN-ID arrives."""
        frame = self.wait_for(can_id, SILENCE_S)
        if frame is not None:
            raise Failed(f"{can_id:03X}h sent {frame.hex(' ') or 'a frame without data'}")


def accepted(answer: bytes) -> bytes:
    """Return the answer. Raises Refused if it is an abort."""
    if answer[0] == ABORT:
        raise Refused(int.from_bytes(answer[4:], "little"))
    return answer


def expect_code(answer: bytes, *codes: int) -> None:
    """Raise Failed unless the answer is an abort with one of the codes."""
    if answer[0] != ABORT:
        raise Failed(f"answered by {answer.hex(' ')}, no abort")
    check_code(int.from_bytes(answer[4:], "little"), *codes)


def check_code(code: int, *codes: int) -> None:
    """Raise Failed unless `code` is one of `codes`; without codes, any is accepted."""
    if codes and code not in codes:
        expected = " or ".join(f"{expected:08X}h" for expected in codes)
        raise Failed(f"aborted with {code:08X}h instead of {expected}")
