"""TIME consumer 1012h, and the high-resolution time stamp 1013h: microseconds since midnight, modulo 2^32.

The clock runs with the time of the bench (simulated in lockstep); TIME or a write of 1013h sets it.
"""

import struct

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.identifiers import EXTENDED_FRAME, check_identifier
from hil_sim.node.nmt import Clock
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

TIME, TIME_STAMP = 0x1012, 0x1013
CONSUMES, PRODUCES = 0x8000_0000, 0x4000_0000
TIME_OF_DAY = struct.Struct("<IH")
"""Milliseconds since midnight (28 bits), days since 1984-01-01."""
MILLISECONDS = 0x0FFF_FFFF
MODULUS = 1 << 32


class TimeConsumer:
    """Clock of one node."""

    def __init__(self, dictionary: Dictionary, clock: Clock) -> None:
        self._dictionary = dictionary
        self._clock = clock
        self._offset_us = 0
        dictionary.checks[TIME] = _check
        dictionary.readers[TIME_STAMP] = lambda _sub: (clock.now_us + self._offset_us) % MODULUS
        dictionary.checks[TIME_STAMP] = lambda _sub, value: self._set(value)

    @property
    def cob_id(self) -> int | None:
        """Identifier of the TIME that the node consumes; None where it consumes none."""
        value = int(self._dictionary.value(TIME))
        return value & 0x7FF if value & CONSUMES else None

    def on_time(self, data: bytes) -> None:
        """Set the clock to the time of day; a frame of another length is ignored."""
        if len(data) == TIME_OF_DAY.size:
            milliseconds, _days = TIME_OF_DAY.unpack(data)
            self._set((milliseconds & MILLISECONDS) * 1000)

    def _set(self, time_us: int) -> None:
        self._offset_us = time_us - self._clock.now_us


def _check(_subindex: int, cob_id: int) -> None:
    """Refuse extended frames, restricted identifiers, and to produce TIME: the master does."""
    if cob_id & (EXTENDED_FRAME | PRODUCES):
        raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
    check_identifier(cob_id)
