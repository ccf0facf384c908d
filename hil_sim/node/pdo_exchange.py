"""The PDOs of one operational node: received with their time-outs, sent at the SYNC or by events."""

from collections.abc import Callable

from hil_sim.node import emcy
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.emcy import EmergencyProducer
from hil_sim.node.nmt import NEVER_US
from hil_sim.node.pdo import Rpdo, Tpdo
from hil_sim.node.pdo_configuration import PdoConfiguration

FIRST_EVENT_DRIVEN = 254
"""Transmission types from here on; 253 is sent on request alone."""


class PdoExchange:
    """The PDOs that the dictionary enables; calls `on_change` when a client may have changed their set."""

    def __init__(
        self,
        dictionary: Dictionary,
        emergency: EmergencyProducer,
        send: Callable[[int, bytes], None],
        on_change: Callable[[], None],
    ) -> None:
        self._configuration = PdoConfiguration(dictionary, on_change)
        self._emergency = emergency
        self._send = send
        self.rpdos: list[Rpdo] = []
        self.synchronous: list[Tpdo] = []
        self._event_driven: list[Tpdo] = []
        self.on_request: list[Tpdo] = []
        """TPDOs that answer a remote frame."""

    def configure(self, operational: bool, sync_counter: Callable[[], int] | None = None) -> None:
        """Compile the enabled PDOs again, with `tpdo_of`; a node that is not operational has none."""
        self._emergency.clear(emcy.PDO_TOO_SHORT, emcy.PDO_TOO_LONG, emcy.RPDO_TIMEOUT)
        self.rpdos = self._configuration.rpdos(self._report_length) if operational else []
        tpdos = self._configuration.tpdos(self._send, sync_counter) if operational else []
        self.synchronous = [tpdo for tpdo in tpdos if tpdo.synchronous]
        self._event_driven = [tpdo for tpdo in tpdos if tpdo.settings.transmission_type >= FIRST_EVENT_DRIVEN]
        self.on_request = [tpdo for tpdo in tpdos if tpdo.settings.remote]

    def receive(self, rpdo: Rpdo, data: bytes, now_us: int) -> bool:
        """Receive a frame; return whether process objects have changed (asynchronous types)."""
        if rpdo.event_timer_us:
            rpdo.deadline_us = now_us + rpdo.event_timer_us
            self._emergency.clear(emcy.RPDO_TIMEOUT)
        return rpdo.receive(data)

    def activate(self) -> bool:
        """Let the buffered RPDOs take effect at a SYNC; return whether there were any."""
        any_activated = False
        for rpdo in self.rpdos:
            any_activated |= rpdo.activate()
        return any_activated

    def sample(self) -> None:
        """Send the synchronous TPDOs at a SYNC."""
        for tpdo in self.synchronous:
            tpdo.on_sync()

    def run(self, now_us: int) -> None:
        """Send the event-driven TPDOs that are due, and report RPDOs that are overdue."""
        for tpdo in self._event_driven:
            tpdo.on_event_check(now_us)
        for rpdo in self.rpdos:
            if now_us >= rpdo.deadline_us:
                rpdo.deadline_us = NEVER_US  # armed again by the next frame
                self._emergency.report(emcy.RPDO_TIMEOUT, emcy.COMMUNICATION)

    def _report_length(self, number: int, size: int, expected: int) -> None:
        if size == expected:
            self._emergency.clear(emcy.PDO_TOO_SHORT, emcy.PDO_TOO_LONG)
            return
        code = emcy.PDO_TOO_SHORT if size < expected else emcy.PDO_TOO_LONG
        self._emergency.report(code, emcy.COMMUNICATION, bytes((number, size, expected)))
