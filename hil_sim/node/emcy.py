"""Emergency producer: error register 1001h, history 1003h, identifier 1014h, inhibit time 1015h."""

import struct
from collections import deque
from collections.abc import Callable
from functools import reduce
from operator import or_

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.identifiers import check_identifier
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

GENERIC, COMMUNICATION, PROFILE = 1, 16, 32  # bits of the error register

OVERRUN = 0x8110  # CAN objects lost
HEARTBEAT_LOST = 0x8130
BUS_OFF_RECOVERED = 0x8140
PDO_TOO_SHORT = 0x8210  # not processed due to length error
PDO_TOO_LONG = 0x8220  # length exceeded, surplus ignored
SYNC_LENGTH = 0x8240
RPDO_TIMEOUT = 0x8250
SYNC_MISSING = 0x8700
FOLLOWING_ERROR = 0x8611
NEIGHBOUR = 0xFF10
"""A node whose EMCY is consumed (1028h) reports an error; the detail holds its id and the error code."""

FRAME = struct.Struct("<HB5s")
DISABLED = 0x8000_0000
HISTORY = 8
"""Entries of 1003h in the EDS files of the devices."""
LONGEST_QUEUE = 64
"""Bounds the messages that wait for the inhibit time; beyond it the oldest is dropped (chosen)."""


class EmergencyProducer:
    """The active errors of one node; each stays in the error register until `clear` ends it."""

    def __init__(self, dictionary: Dictionary, send: Callable[[int, bytes], None]) -> None:
        self._dictionary = dictionary
        self._objects = dictionary.objects
        self._send = send
        self._active: dict[int, int] = {}  # error code -> bits of the error register
        self._history: deque[int] = deque(maxlen=HISTORY)
        self._waiting: deque[bytes] = deque(maxlen=LONGEST_QUEUE)
        self._free_at_us = 0
        self.enabled = False
        dictionary.readers[0x1003] = self._read_history
        dictionary.checks[0x1003] = self._clear_history
        dictionary.checks[0x1014] = self._check_identifier

    def report(self, code: int, register: int, detail: bytes = b"") -> None:
        """Report error `code`, once until `clear(code)`; `detail` holds up to 5 bytes of its own."""
        if code in self._active:
            return
        self._active[code] = register | GENERIC
        self._update_register()
        self._history.appendleft(code)
        self._waiting.append(FRAME.pack(code, self._objects.error_register, detail))

    def clear(self, *codes: int) -> None:
        """End the errors `codes`: report "error reset or no error" once for those that were active."""
        present = [code for code in codes if code in self._active]
        for code in present:
            del self._active[code]
        if present:
            self._update_register()
            self._waiting.append(FRAME.pack(0, self._objects.error_register, b""))

    def reset(self) -> None:
        """Clear errors and history, as after power-up, without a message."""
        self._active.clear()
        self._history.clear()
        self._waiting.clear()
        self._free_at_us = 0
        self._update_register()

    def flush(self, now_us: int) -> None:
        """Send the waiting messages, each after the inhibit time."""
        while self._waiting and self.enabled and now_us >= self._free_at_us:
            cob_id = self._dictionary.value(0x1014)
            if not cob_id & DISABLED:
                self._send(cob_id & 0x7FF, self._waiting.popleft())
                self._free_at_us = now_us + 100 * self._dictionary.value(0x1015)
            else:
                self._waiting.clear()

    @property
    def waiting(self) -> bool:
        """Whether `flush` has something to do."""
        return bool(self._waiting)

    def _update_register(self) -> None:
        self._objects.error_register = reduce(or_, self._active.values(), 0)

    def _read_history(self, subindex: int) -> int:
        if subindex == 0:
            return len(self._history)
        if subindex > len(self._history):
            raise SdoAbort(AbortCode.NO_DATA)
        return self._history[subindex - 1]

    def _clear_history(self, subindex: int, value: int) -> None:
        if subindex == 0 and value == 0:
            self._history.clear()
        else:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

    def _check_identifier(self, _subindex: int, cob_id: int) -> None:
        check_identifier(cob_id)
        present = self._dictionary.value(0x1014)
        if not (present | cob_id) & DISABLED and present != cob_id:
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)  # it must be disabled first, as a PDO
