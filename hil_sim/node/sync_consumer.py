"""What a node expects of the SYNC: its counter (1019h), its period (1006h), the window after it (1007h).

A node that watches nothing of this costs the cycle nothing: `watches` decides where its SYNCs are routed.
"""

from collections.abc import Callable

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.nmt import NEVER_US, Clock
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

PERIOD, WINDOW, OVERFLOW = 0x1006, 0x1007, 0x1019
LARGEST_OVERFLOW = 240
LATE = 1.5
"""Cycles without a SYNC after which it counts as missing (chosen, as CANopenNode has it)."""


class SyncConsumer:
    """Counter, deadline and window of one node; calls `on_missing()` once, `on_return()` at the next SYNC."""

    def __init__(
        self,
        dictionary: Dictionary,
        clock: Clock,
        on_missing: Callable[[], None],
        on_return: Callable[[], None],
    ) -> None:
        self._dictionary = dictionary
        self._clock = clock
        self._on_missing = on_missing
        self._on_return = on_return
        self._missing = False
        self._at_us = 0  # of the last SYNC
        self.counter = 0
        """Of the last SYNC; 0 where it has none."""
        self.due_us = NEVER_US
        dictionary.checks[OVERFLOW] = self._check_overflow
        self.follow()

    def follow(self) -> None:
        """Apply 1007h and 1019h; the first SYNC from here on starts the supervision."""
        self.counted = bool(self._dictionary.value(OVERFLOW))
        self.window_us = self._dictionary.value(WINDOW)
        self.counter = 0
        self.due_us = NEVER_US

    @property
    def watches(self) -> bool:
        """Whether the node looks at its SYNCs at all."""
        return self.counted or bool(self.window_us)

    def length_is_right(self, data: bytes) -> bool:
        """Take the counter of a SYNC; return whether it has one where 1019h says so, and only there."""
        self.counter = data[0] if self.counted and data else 0
        return len(data) == self.counted

    def on_sync(self) -> None:
        """Start the window, and the time within which the next SYNC has to come."""
        now_us = self._clock.now_us
        self._at_us = now_us
        period_us = self._dictionary.value(PERIOD)
        self.due_us = now_us + round(LATE * period_us) if self.window_us and period_us else NEVER_US
        if self._missing:
            self._missing = False
            self._on_return()

    def in_window(self) -> bool:
        """Whether a synchronous RPDO of now still counts for the last SYNC."""
        return not self.window_us or self._clock.now_us - self._at_us <= self.window_us

    def run(self) -> None:
        """Report the SYNC as missing."""
        if self._clock.now_us >= self.due_us:
            self.due_us = NEVER_US
            self._missing = True
            self._on_missing()

    def _check_overflow(self, _subindex: int, value: int) -> None:
        """CiA 301 7.5.2.22: 0 or 2 to 240, and only while there is no period."""
        if value and not 2 <= value <= LARGEST_OVERFLOW:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        if self._dictionary.value(PERIOD):
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
