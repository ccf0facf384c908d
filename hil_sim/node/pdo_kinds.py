"""TPDOs that do not go out by themselves at every n-th SYNC: on request, or counted from a certain SYNC."""

from collections.abc import Callable

from hil_sim.node.pdo import SAMPLED_AT_SYNC, MappedObject, PdoSettings, Tpdo
from hil_sim.node.process_objects import ProcessObjects

SAMPLED_AT_REQUEST = 253


class RequestedTpdo(Tpdo):
    """Sent at a remote frame alone; type 252 shows the values of the last SYNC, 253 the present ones."""

    _sampled: bytes | None = None
    """None before the first SYNC."""

    def on_sync(self) -> None:
        """Take the values that a request will ask for."""
        self._sampled = self.sample()

    def on_request(self) -> None:
        """Send them, or the present ones."""
        frame = self._sampled if self.synchronous else self.sample()
        if frame is not None:
            self._send(self.cob_id, frame)


class CountedTpdo(Tpdo):
    """Cyclic, its SYNCs counted from the first with counter value `settings.sync_start` (180xh:06)."""

    def __init__(
        self,
        settings: PdoSettings,
        mapping: list[MappedObject],
        objects: ProcessObjects,
        send: Callable[[int, bytes], None],
        counter: Callable[[], int],
    ) -> None:
        super().__init__(settings, mapping, objects, send)
        self._counter = counter
        self._started = False

    def on_sync(self) -> None:
        """Count from the SYNC on whose counter equals the SYNC start value (CiA 301)."""
        self._started = self._started or self._counter() == self.settings.sync_start
        if self._started:
            super().on_sync()


def tpdo_of(
    settings: PdoSettings,
    mapping: list[MappedObject],
    objects: ProcessObjects,
    send: Callable[[int, bytes], None],
    sync_counter: Callable[[], int] | None,
) -> Tpdo:
    """The TPDO of these settings; `sync_counter` gives the counter of the last SYNC, None: it has none."""
    if settings.transmission_type in {SAMPLED_AT_SYNC, SAMPLED_AT_REQUEST}:
        return RequestedTpdo(settings, mapping, objects, send)
    cyclic = 0 < settings.transmission_type < SAMPLED_AT_SYNC
    if cyclic and settings.sync_start and sync_counter is not None:
        return CountedTpdo(settings, mapping, objects, send, sync_counter)
    return Tpdo(settings, mapping, objects, send)
