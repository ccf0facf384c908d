"""TPDO 1 of our own node: when it is due, counted in SYNC cycles. Objects 1800h:01, :02, :03 and :05."""

from collections.abc import Callable
from typing import NamedTuple

from servo_ctrl.canopen.sdo_abort import AbortCode, SdoAbort

SWITCHED_OFF = 0x8000_0000
"""Bit 31 of the COB-ID: the PDO does not exist."""
SYNCHRONOUS_ACYCLIC = 0
SYNCHRONOUS_MAX = 240
EVENT_DRIVEN = (254, 255)
INHIBIT_UNIT_S = 1e-4
TIMER_UNIT_S = 1e-3
COB_ID, TRANSMISSION_TYPE, INHIBIT_TIME, EVENT_TIMER = 1, 2, 3, 5


class TpdoSettings(NamedTuple):
    """The communication parameter, as in 1800h."""

    cob_id: int
    transmission_type: int
    inhibit_time: int
    """Multiples of 100 us."""
    event_timer_ms: int


class StatusTpdo:
    """Decides when to `send`; our node's NMT state is its caller's business."""

    def __init__(self, settings: TpdoSettings, period_s: float, send: Callable[[int], None]) -> None:
        self._period_s, self._send = period_s, send
        self._changed = False
        self._since_cycles = 0
        self.settings = settings

    @property
    def settings(self) -> TpdoSettings:
        """What the PDO is set to."""
        return self._settings

    @settings.setter
    def settings(self, settings: TpdoSettings) -> None:
        self._settings = settings
        self._inhibit_cycles = round(settings.inhibit_time * INHIBIT_UNIT_S / self._period_s)
        self._timer_cycles = round(settings.event_timer_ms * TIMER_UNIT_S / self._period_s)
        if settings.event_timer_ms:
            self._timer_cycles = max(self._timer_cycles, 1)
        self._since_cycles = 0

    def read(self, subindex: int) -> int:
        """An entry of 1800h."""
        kept = self._settings
        return {
            0: EVENT_TIMER,
            COB_ID: kept.cob_id,
            TRANSMISSION_TYPE: kept.transmission_type,
            INHIBIT_TIME: kept.inhibit_time,
            EVENT_TIMER: kept.event_timer_ms,
        }[subindex]

    def write(self, subindex: int, value: int) -> None:
        """Change an entry of 1800h. Raises SdoAbort."""
        if subindex == COB_ID:
            if (value ^ self._settings.cob_id) & ~SWITCHED_OFF:
                raise SdoAbort(AbortCode.INVALID_VALUE)  # another identifier might be that of a drive's PDO
            self.settings = self._settings._replace(cob_id=value)
        elif subindex == TRANSMISSION_TYPE:
            if value > SYNCHRONOUS_MAX and value not in EVENT_DRIVEN:
                raise SdoAbort(AbortCode.INVALID_VALUE)
            self.settings = self._settings._replace(transmission_type=value)
        elif subindex == INHIBIT_TIME:
            self.settings = self._settings._replace(inhibit_time=value)
        else:
            self.settings = self._settings._replace(event_timer_ms=value)

    def announce(self) -> None:
        """Something changed: send with the next cycle, unless it is sent by the count of SYNCs anyway."""
        self._changed = True

    def count_cycles(self, elapsed: int) -> None:
        """A SYNC was sent, `elapsed` periods after the one before; sends what is due."""
        settings = self._settings
        if settings.cob_id & SWITCHED_OFF:
            return
        kind = settings.transmission_type
        if kind in EVENT_DRIVEN:
            self._since_cycles += elapsed
            timer = self._timer_cycles
            due = self._changed and self._since_cycles >= self._inhibit_cycles
            due = due or (timer > 0 and self._since_cycles >= timer)
        elif kind == SYNCHRONOUS_ACYCLIC:
            due = self._changed
        else:
            self._since_cycles += 1  # SYNCs, not periods: a SYNC that was missed was not sent
            due = self._since_cycles >= kind
        if due:
            self._changed = False
            self._since_cycles = 0
            self._send(settings.cob_id & 0x7FF)

    def flush(self) -> None:
        """Send a change that waits for its cycle, as there will be none."""
        if self._changed and not self._settings.cob_id & SWITCHED_OFF:
            self._changed = False
            self._send(self._settings.cob_id & 0x7FF)
