"""LSS slave (CiA 305): node id and bit rate assigned over the bus.

The master addresses a node by selection, identification or fastscan, and configures, activates and stores
both, in a small file per device beside its stored parameters. A node that has an id serves LSS in every NMT
state but operational; one without an id (255) serves nothing else.
"""

import json
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import NamedTuple, Protocol

from hil_sim.node.storage import StoredParametersError, replace_json

FORMAT = 1
RATES_KBIT_S = (1000, 800, 500, 250, 125, 50, 20)


class StoredLss(NamedTuple):
    """Node id and bit rate; None where LSS has assigned none."""

    node_id: int | None = None
    bit_rate_kbit_s: int | None = None


def stored_lss(file: Path | None) -> StoredLss:
    """Read the file; without one nothing is assigned. Raises StoredParametersError for a damaged file."""
    if file is None or not file.exists():
        return StoredLss()
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        number, node_id = content["format"], content["node_id"]
        rate = content.get("bit_rate_kbit_s")  # files had none before bit timing
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise StoredParametersError(file, f"no node id: {error}") from error
    if number != FORMAT or type(node_id) is not int or not (1 <= node_id <= 127 or node_id == 255):
        raise StoredParametersError(file, f"no node id: {content}")
    if rate is not None and rate not in RATES_KBIT_S:
        raise StoredParametersError(file, f"no bit rate: {content}")
    return StoredLss(node_id, rate)


def store_lss(file: Path, node_id: int, bit_rate_kbit_s: int) -> bool:
    """Write the file in one step; return whether that worked."""
    try:
        replace_json(file, {"format": FORMAT, "node_id": node_id, "bit_rate_kbit_s": bit_rate_kbit_s})
    except OSError:
        return False
    return True


REQUEST, RESPONSE = 0x7E5, 0x7E4
FRAME_BYTES = 8
UNNAMED = 255
"""The node id of a node without an assigned id."""
SWITCH_GLOBAL, CONFIGURE_NODE_ID, CONFIGURE_BIT_TIMING, ACTIVATE_BIT_TIMING, STORE = 4, 0x11, 0x13, 0x15, 0x17
STANDARD_RATES_KBIT_S = (1000, 800, 500, 250, 125, None, 50, 20, None)
"""By index in table 0 of CiA 305; None: the devices support neither 10 kbit/s nor automatic detection."""
SELECT = range(0x40, 0x44)
"""Vendor, product, revision, serial number of the node that is selected."""
SELECTED = 0x44
IDENTIFY = range(0x46, 0x4C)
"""Vendor, product, revision from and to, serial number from and to."""
IDENTIFY_UNNAMED, IDENTIFIED, UNNAMED_IDENTIFIED, FASTSCAN = 0x4C, 0x4F, 0x50, 0x51
INQUIRE_IDENTITY = range(0x5A, 0x5E)
INQUIRE_NODE_ID = 0x5E
ACCEPTED, REFUSED, STORE_FAILED = 0, 1, 2
"""Error codes of an answer; 1: out of range, or not supported."""
SCAN_BEGINS = 0x80
"""Bit number of the fastscan request that every node without an id answers."""
WORDS = 4
"""Words of 32 bits in an LSS address: vendor, product, revision, serial number."""


class LssState(Enum):
    """States of an LSS slave."""

    WAITING = 0
    CONFIGURATION = 1


class NamedNode(Protocol):
    """The node to which LSS assigns an id."""

    node_id: int
    """The active id, UNNAMED without one."""

    def identity(self) -> tuple[int, int, int, int]:
        """Return vendor, product, revision and serial number, 1018h."""

    def serves_lss(self) -> bool:
        """Return whether it serves LSS: not while operational, not when dead."""

    def start_named(self) -> None:
        """Start with the pending id: this node had none."""

    def store_lss(self, node_id: int, rate_kbit_s: int) -> bool:
        """Store id and bit rate; return whether that worked."""

    def bit_rate_kbit_s(self) -> int:
        """Return its bit rate."""

    def switch_rate(self, rate_kbit_s: int, delay_ms: int) -> None:
        """Switch to a bit rate after a delay, and send nothing for another delay."""


class LssSlave:
    """LSS state of one node; `pending` is the id that takes effect at the next reset of the communication."""

    def __init__(self, node: NamedNode, send: Callable[[int, bytes], None]) -> None:
        self._node = node
        self._send = send
        self._mode = LssState.WAITING
        self._selected = 0  # how many words of the selected address have matched so far
        self._identified = 0  # how many conditions of an identification have matched so far
        self._scanned = 0  # the word of the address that the fastscan has reached
        self.pending = node.node_id
        self._pending_kbit_s: int | None = None

    def on_request(self, data: bytes) -> None:
        """Serve a frame of the LSS master."""
        if len(data) != FRAME_BYTES or not self._node.serves_lss():
            return
        command, number = data[0], int.from_bytes(data[1:5], "little")
        if command == SWITCH_GLOBAL:
            self._switch(data[1])
        elif command == FASTSCAN:
            self._fastscan(number, *data[5:])
        elif command in SELECT:
            self._select(command, number)
        elif command in IDENTIFY:
            self._identify(command, number)
        elif command == IDENTIFY_UNNAMED:
            if self._node.node_id == UNNAMED:
                self._answer(UNNAMED_IDENTIFIED)
        elif self._mode is LssState.CONFIGURATION:
            self._configure(command, data[1], data[2])

    def _switch(self, mode: int) -> None:
        named = self._mode is LssState.CONFIGURATION and mode == LssState.WAITING.value
        self._mode = LssState.CONFIGURATION if mode == LssState.CONFIGURATION.value else LssState.WAITING
        if named and self._node.node_id == UNNAMED != self.pending:
            self._node.start_named()

    def _configure(self, command: int, value: int, second: int) -> None:
        if command == CONFIGURE_NODE_ID:
            accepted = 1 <= value <= 127 or value == UNNAMED
            if accepted:
                self.pending = value
            self._answer(command, ACCEPTED if accepted else REFUSED)
        elif command == CONFIGURE_BIT_TIMING:
            self._answer(command, ACCEPTED if self._note_rate(value, second) else REFUSED)
        elif command == ACTIVATE_BIT_TIMING:
            self._node.switch_rate(self._rate_kbit_s(), value | second << 8)
        elif command == STORE:
            stored = self._node.store_lss(self.pending, self._rate_kbit_s())
            self._answer(command, ACCEPTED if stored else STORE_FAILED)
        elif command in INQUIRE_IDENTITY:
            number = self._node.identity()[command - INQUIRE_IDENTITY.start]
            self._answer(command, *number.to_bytes(4, "little"))
        elif command == INQUIRE_NODE_ID:
            self._answer(command, self._node.node_id)

    def _note_rate(self, table: int, index: int) -> bool:
        """Note the rate to activate or to store; return whether the device supports it."""
        known = table == 0 and index < len(STANDARD_RATES_KBIT_S)
        rate = STANDARD_RATES_KBIT_S[index] if known else None
        if rate is not None:
            self._pending_kbit_s = rate
        return rate is not None

    def _rate_kbit_s(self) -> int:
        return self._node.bit_rate_kbit_s() if self._pending_kbit_s is None else self._pending_kbit_s

    def _select(self, command: int, number: int) -> None:
        word = command - SELECT.start
        matches = word in {0, self._selected} and self._node.identity()[word] == number
        self._selected = word + 1 if matches else 0
        if self._selected == WORDS:
            self._selected = 0
            self._mode = LssState.CONFIGURATION
            self._answer(SELECTED)

    def _identify(self, command: int, number: int) -> None:
        step = command - IDENTIFY.start
        vendor, product, revision, serial = self._node.identity()
        matches = (
            vendor == number,
            product == number,
            revision >= number,
            revision <= number,
            serial >= number,
            serial <= number,
        )[step]
        self._identified = step + 1 if matches and step in {0, self._identified} else 0
        if self._identified == len(IDENTIFY):
            self._identified = 0
            self._answer(IDENTIFIED)

    def _fastscan(self, number: int, bit: int, word: int, following: int) -> None:
        """Answer where the address matches down to `bit`; a full match selects the node."""
        if self._node.node_id != UNNAMED or self._mode is not LssState.WAITING:
            return
        if bit == SCAN_BEGINS:
            self._scanned = 0
            self._answer(IDENTIFIED)
            return
        if bit > 31 or word >= WORDS or word != self._scanned:
            return
        if (self._node.identity()[word] ^ number) >> bit:
            return
        if bit == 0 and following != word:
            self._scanned = following
            if following < word:
                self._mode = LssState.CONFIGURATION
        self._answer(IDENTIFIED)

    def _answer(self, *content: int) -> None:
        self._send(RESPONSE, bytes(content).ljust(FRAME_BYTES, b"\0"))
