"""TPDO 1 of our own node, timed in SYNC cycles (1800h:01, :02, :03 and :05)."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Self

from servo_ctrl.canopen.errors import AbortCode, SdoAbort
from servo_ctrl.canopen.pdo import COB_ID_INVALID

SYNCHRONOUS_ACYCLIC = 0
SYNCHRONOUS_MAX = 240
EVENT_DRIVEN = (254, 255)
"""Transmission types of CiA 301; those from 1 to `SYNCHRONOUS_MAX` are a number of SYNCs."""
INHIBIT_UNIT_S, TIMER_UNIT_S = 1e-4, 1e-3
"""Units of the inhibit time and of the event timer (CiA 301)."""


class TpdoSettings(NamedTuple):
    """Communication parameter 1800h."""

    cob_id: int
    transmission_type: int
    inhibit_time: int
    """Multiples of 100 us."""
    event_timer_ms: int

    def with_stored(self, values: Mapping[str, int]) -> Self:
        """Return these settings with the stored values, if still valid; the CAN-ID may only be on or off."""
        stored = self._replace(**{name: value for name, value in values.items() if name in self._fields})
        transmission_type = stored.transmission_type
        if (stored.cob_id ^ self.cob_id) & ~COB_ID_INVALID or (
            transmission_type > SYNCHRONOUS_MAX and transmission_type not in EVENT_DRIVEN
        ):
            return self
        return stored


SUBINDICES = dict(zip((1, 2, 3, 5), TpdoSettings._fields, strict=True))
"""Subindices of the fields in 1800h; 4 is reserved."""


class StatusTpdo:
    """Decides when to `send`; the caller considers the NMT state of our node."""

    def __init__(self, defaults: TpdoSettings, period_s: float, send: Callable[[int], None]) -> None:
        self._defaults, self._period_s, self._send = defaults, period_s, send
        self._changed = False
        self.reset()

    @property
    def settings(self) -> TpdoSettings:
        """The present settings."""
        return self._settings

    @property
    def is_on(self) -> bool:
        """Whether bit 31 of its COB-ID is clear."""
        return not self._settings.cob_id & COB_ID_INVALID

    def reset(self) -> None:
        """Return to the default settings."""
        self._use(self._defaults)

    def read(self, subindex: int) -> int:
        """Read an entry of 1800h."""
        return getattr(self._settings, SUBINDICES[subindex]) if subindex else max(SUBINDICES)

    def write(self, subindex: int, value: int) -> None:
        """Change an entry of 1800h. Raises SdoAbort."""
        match SUBINDICES[subindex]:
            case "cob_id" if (value ^ self._settings.cob_id) & ~COB_ID_INVALID:
                raise SdoAbort(AbortCode.INVALID_VALUE)  # another identifier might be that of a drive's PDO
            case "transmission_type" if value > SYNCHRONOUS_MAX and value not in EVENT_DRIVEN:
                raise SdoAbort(AbortCode.INVALID_VALUE)
            case name:
                self._use(self._settings._replace(**{name: value}))

    def _use(self, settings: TpdoSettings) -> None:
        self._settings, self._since_cycles = settings, 0
        self._inhibit_cycles = round(settings.inhibit_time * INHIBIT_UNIT_S / self._period_s)
        self._timer_cycles = max(round(settings.event_timer_ms * TIMER_UNIT_S / self._period_s), 1)

    def announce(self) -> None:
        """Announce a change: send with the next cycle, unless the type is a number of SYNCs."""
        self._changed = True

    def count_cycles(self, elapsed: int) -> None:
        """Count a SYNC, `elapsed` periods after the last one; send the TPDO if it is due."""
        cob_id, transmission_type, _, timer_ms = self._settings
        if cob_id & COB_ID_INVALID:
            return
        if transmission_type in EVENT_DRIVEN:
            self._since_cycles += elapsed
            due = self._changed and self._since_cycles >= self._inhibit_cycles
            due = due or (timer_ms > 0 and self._since_cycles >= self._timer_cycles)
        elif transmission_type == SYNCHRONOUS_ACYCLIC:
            due = self._changed
        else:
            self._since_cycles += 1  # SYNCs, not periods: a missed SYNC was not sent
            due = self._since_cycles >= transmission_type
        if due:
            self._since_cycles, self._changed = 0, False
            self._send(cob_id & 0x7FF)

    def flush(self) -> None:
        """Send an announced change now, because no cycle will follow."""
        if self._changed and not self._settings.cob_id & COB_ID_INVALID:
            self._changed = False
            self._send(self._settings.cob_id & 0x7FF)
