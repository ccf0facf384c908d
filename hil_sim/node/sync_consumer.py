"""SYNC consumer: counter (1019h), period (1006h), and synchronous window (1007h) of the SYNC.

Most nodes supervise none of them: `watches` decides whether their SYNCs are routed through this consumer.
"""

from collections.abc import Callable

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.nmt import NEVER_US, Clock
from hil_sim.node.sdo_abort import AbortCode, SdoAbort

PERIOD, WINDOW, OVERFLOW = 0x1006, 0x1007, 0x1019
LARGEST_OVERFLOW = 240
LATE = 1.5
"""Periods without a SYNC after which it counts as missing (chosen, as in CANopenNode)."""


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
        self._at_us = 0  # time of the last SYNC
        self.counter = 0
        """Counter of the last SYNC; 0 where it had none."""
        self.due_us = NEVER_US
        dictionary.checks[OVERFLOW] = self._check_overflow
        self.follow()

    def follow(self) -> None:
        """Apply 1007h and 1019h; the next SYNC starts the supervision."""
        self.counted = bool(self._dictionary.value(OVERFLOW))
        self.window_us = self._dictionary.value(WINDOW)
        self.counter = 0
        self.due_us = NEVER_US

    @property
    def watches(self) -> bool:
        """Whether the node supervises its SYNCs at all."""
        return self.counted or bool(self.window_us)

    def length_is_right(self, data: bytes) -> bool:
        """Store the counter of a SYNC; return whether the frame has one exactly if 1019h requires it."""
        self.counter = data[0] if self.counted and data else 0
        return len(data) == self.counted

    def on_sync(self) -> None:
        """Start the window, and the time within which the next SYNC must arrive."""
        now_us = self._clock.now_us
        self._at_us = now_us
        period_us = self._dictionary.value(PERIOD)
        self.due_us = now_us + round(LATE * period_us) if self.window_us and period_us else NEVER_US
        if self._missing:
            self._missing = False
            self._on_return()

    def in_window(self) -> bool:
        """Return whether a synchronous RPDO received now is within the window of the last SYNC."""
        return not self.window_us or self._clock.now_us - self._at_us <= self.window_us

    def run(self) -> None:
        """Report the SYNC as missing."""
        if self._clock.now_us >= self.due_us:
            self.due_us = NEVER_US
            self._missing = True
            self._on_missing()

    def _check_overflow(self, _subindex: int, value: int) -> None:
        """Refuse other values than 0 and 2 to 240, and any while a period is set (CiA 301, 7.5.2.22)."""
        if value and not 2 <= value <= LARGEST_OVERFLOW:
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)
        if self._dictionary.value(PERIOD):
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
