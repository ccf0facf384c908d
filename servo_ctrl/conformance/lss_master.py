"""LSS master (CiA 305): finds nodes without a node id, and configures node ids and bit rates.

Fastscan: all nodes without an id answer at the same time, and the master determines the lowest address bit by
bit. That node is then in configuration state and ignores further scans, so the next scan finds the next one.
"""

import struct
import time
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from servo_ctrl.conformance.dialogue import Failed, Wire

REQUEST, RESPONSE = 0x7E5, 0x7E4
FRAME_BYTES = 8
SWITCH_GLOBAL, CONFIGURE_NODE_ID, STORE, SELECT_VENDOR, SELECTED = 0x04, 0x11, 0x17, 0x40, 0x44
CONFIGURE_BIT_TIMING, ACTIVATE_BIT_TIMING = 0x13, 0x15
RATES_KBIT_S = {1000: 0, 800: 1, 500: 2, 250: 3, 125: 4, 50: 6, 20: 7, 10: 8}
"""Index of a bit rate in table 0."""
IDENTIFIED, FASTSCAN = 0x4F, 0x51
WAITING, CONFIGURATION = 0, 1
SCAN = struct.Struct("<BIBBB")
"""Command specifier, LSS number, bit checked, LSS sub, LSS next."""
SCAN_BEGINS = 0x80
BITS, WORDS = 32, 4
RESPONSE_LIMIT_S = 0.05
"""Bounds the wait for a response; chosen: nodes respond within some milliseconds."""
STORE_LIMIT_S = 1.0
"""Bounds the wait while a node writes its memory; chosen."""
NODES_MAX = 127
RESET_COMMUNICATION = 130


class Address(NamedTuple):
    """LSS address: vendor, product, revision and serial number (1018h), unique for each node."""

    vendor: int
    product: int
    revision: int
    serial: int

    @property
    def line(self) -> str:
        """Line for the terminal, in the columns of `FoundNode.line`."""
        return f"no node id               {self.numbers}"

    @property
    def numbers(self) -> str:
        """The four numbers as text."""
        return " ".join(f"{number:08X}h" for number in self)


def find_unnamed(wire: Wire) -> list[Address]:
    """Find the addresses of all nodes without an id, and return the nodes to waiting state.

    Raises Failed for an inconsistent scan.
    """
    addresses: list[Address] = []
    while len(addresses) < NODES_MAX and (address := _fastscan(wire)) is not None:
        addresses.append(address)
    if addresses:
        _switch_to_waiting(wire)
    return addresses


def configure_ids(wire: Wire, ids: Iterable[tuple[Address, int, int | None]]) -> None:
    """Configure and store the id of each node; `ids`: (address, new id, present id or None).

    A node without an id boots with the new one; the communication of any other is reset, and it must not be
    operational.

    Raises:
        Failed: a node does not answer, or refuses; the nodes before it have their ids.
    """
    for address, node_id, present in ids:
        _select(wire, address)
        _confirm(wire, bytes((CONFIGURE_NODE_ID, node_id)), f"node id {node_id}")
        _confirm(wire, bytes((STORE,)), "storing the node id")
        _switch_to_waiting(wire)
        if present is not None:
            wire.send(0x000, bytes((RESET_COMMUNICATION, present)))


def set_bit_rate(wire: Wire, addresses: Sequence[Address], rate_kbit_s: int, activate_ms: int | None) -> None:
    """Configure the bit rate of all these nodes, then have all store it.

    It is used from the next power-up on; with `activate_ms`, after that time, followed by silence of the same
    length. If one node refuses the rate, no node stores it.

    Raises:
        Failed: a node does not answer, refuses, or cannot store; nodes before it may have stored.
    """
    for address in addresses:
        _select(wire, address)
        request = bytes((CONFIGURE_BIT_TIMING, 0, RATES_KBIT_S[rate_kbit_s]))
        _confirm(wire, request, f"node {address.numbers}: {rate_kbit_s} kbit/s")
    for address in addresses:
        _select(wire, address)
        _confirm(wire, bytes((STORE,)), f"node {address.numbers}: storing the bit rate")
    if activate_ms is None:
        _switch_to_waiting(wire)
        return
    wire.send(REQUEST, bytes((SWITCH_GLOBAL, CONFIGURATION)).ljust(FRAME_BYTES, b"\0"))
    activation = bytes((ACTIVATE_BIT_TIMING,)) + activate_ms.to_bytes(2, "little")
    wire.send(REQUEST, activation.ljust(FRAME_BYTES, b"\0"))


def _select(wire: Wire, address: Address) -> None:
    """Bring this node alone into configuration state. Raises Failed if it does not answer."""
    _switch_to_waiting(wire)
    for word, number in enumerate(address):
        answer = _exchange(
            wire, bytes((SELECT_VENDOR + word,)) + number.to_bytes(4, "little"), RESPONSE_LIMIT_S
        )
    if answer is None or answer[0] != SELECTED:
        raise Failed(f"node {address.numbers} does not answer; an operational node has no LSS")


def _switch_to_waiting(wire: Wire) -> None:
    wire.send(REQUEST, bytes((SWITCH_GLOBAL, WAITING)).ljust(FRAME_BYTES, b"\0"))


def _confirm(wire: Wire, request: bytes, what: str) -> None:
    answer = _exchange(wire, request, STORE_LIMIT_S)
    if answer is None or answer[0] != request[0]:
        raise Failed(f"{what}: no answer within {STORE_LIMIT_S:g} s")
    if answer[1]:
        raise Failed(f"{what}: refused with LSS error {answer[1]}")


def _exchange(wire: Wire, request: bytes, timeout_s: float) -> bytes | None:
    """Send a request; return the first answer, None without one. Frames that arrived before are dropped."""
    while wire.receive(0.0) is not None:
        pass
    wire.send(REQUEST, request.ljust(FRAME_BYTES, b"\0"))
    ends_s = time.monotonic() + timeout_s
    while (left_s := ends_s - time.monotonic()) > 0.0 and (frame := wire.receive(left_s)) is not None:
        if frame[0] == RESPONSE and len(frame[1]) == FRAME_BYTES:
            return frame[1]
    return None


def _fastscan(wire: Wire) -> Address | None:
    """Find a node without an id and bring it into configuration state; return its address, or None."""

    def confirmed(number: int, bit: int, word: int, following: int) -> bool:
        answer = _exchange(wire, SCAN.pack(FASTSCAN, number, bit, word, following), RESPONSE_LIMIT_S)
        return answer is not None and answer[0] == IDENTIFIED

    if not confirmed(0, SCAN_BEGINS, 0, 0):
        return None
    return Address(*(_word(confirmed, word) for word in range(WORDS)))


def _word(confirmed: Callable[[int, int, int, int], bool], word: int) -> int:
    """Determine one number of the lowest address, from its highest bit down."""
    number = 0
    for bit in reversed(range(BITS)):
        if not confirmed(number, bit, word, word):
            number |= 1 << bit
    if not confirmed(number, 0, word, (word + 1) % WORDS):
        raise Failed(f"fastscan: no node confirms {number:08X}h; is there a second LSS master?")
    return number
