"""One CANopen slave: its services, wired to the device whose objects they carry."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from hil_sim.node import abort_codes, emcy, identifiers
from hil_sim.node.abort_codes import abort
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.emcy import EmergencyProducer
from hil_sim.node.heartbeat_consumer import HeartbeatConsumer
from hil_sim.node.nmt import NEVER_US, Clock, NmtSlave, NmtState
from hil_sim.node.pdo import Rpdo, Tpdo
from hil_sim.node.pdo_configuration import PdoConfiguration
from hil_sim.node.process_objects import ProcessObjects
from hil_sim.node.storage import Storage

SYNC_ID, EMERGENCY_ID, WATCHED_NODES = 0x1005, 0x1014, 0x1016
COMMUNICATING = {NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL}
ON_COMMUNICATION_ERROR = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}  # 1029h.1; 1 changes nothing


class Device(Protocol):
    """The device of a slave; `profile` is the number of its CiA profile."""

    profile: int

    def factory_settings(self) -> None:
        """Put the values that depend on the hardware over the defaults of the EDS."""

    def reset(self) -> None:
        """Reset the device after power-up or a reset of the node."""

    def process(self) -> None:
        """Act on new process objects."""

    def connection_lost(self, code: int) -> None:
        """React to a lost master (`code`: the error), or to one that stopped or reset the node (0)."""

    def is_idle(self) -> bool:
        """Whether parameters may be stored and restored now."""


class Slave:
    """Services of node `node_id`. It calls `on_routes` when the identifiers that it receives have changed.

    Raises:
        OSError, ValueError: the EDS cannot be read, or is none of this profile.
        StoredParametersError: see `Storage`.
    """

    def __init__(
        self,
        node_id: int,
        eds: Path,
        objects: ProcessObjects,
        device: Device,
        clock: Clock,
        send: Callable[[int, bytes], None],
        state_directory: Path | None,
    ) -> None:
        self.mute = False
        """Whether its frames are kept off the bus."""
        self._bus = send
        send = self._send
        self.dictionary = Dictionary(node_id, eds, objects, send)
        self._check_profile(device.profile)
        self._device = device
        self._clock = clock
        self._objects = objects
        self._transmit = send
        self.on_routes: Callable[[], None] = lambda: None
        self.emergency = EmergencyProducer(self.dictionary, send)
        self.heartbeats = HeartbeatConsumer(
            self.dictionary, clock, self._heartbeat_lost, lambda: self.emergency.clear(emcy.HEARTBEAT_LOST)
        )
        self.nmt = NmtSlave(self.dictionary, clock, send, self._state_changed, self._reset)
        self.dictionary.checks[SYNC_ID] = identifiers.check_sync
        self.dictionary.checks[EMERGENCY_ID] = self._check_emergency_id
        self.dictionary.followers[SYNC_ID] = lambda _sub: self.on_routes()
        self.dictionary.followers[WATCHED_NODES] = lambda _sub: self._watch()
        self._pdos = PdoConfiguration(self.dictionary, self._configure_pdos)
        file = None if state_directory is None else state_directory / f"node_{node_id}.json"
        self._storage = Storage(self.dictionary, file, device.is_idle)
        self.rpdos: list[Rpdo] = []
        self._on_sync: list[Tpdo] = []
        self._on_event: list[Tpdo] = []
        self._buffered: list[Rpdo] = []
        self._timed: list[Rpdo] = []

    def _check_emergency_id(self, _subindex: int, cob_id: int) -> None:
        identifiers.check_identifier(cob_id)
        present = self.dictionary.value(EMERGENCY_ID)
        if not (present | cob_id) & emcy.DISABLED and present != cob_id:
            raise abort(abort_codes.WRONG_DEVICE_STATE)  # it must be disabled first, as a PDO

    def _check_profile(self, profile: int) -> None:
        described = self.dictionary.value(0x1000) & 0xFFFF
        if described != profile:
            raise ValueError(f"device profile {described}, not {profile}")

    @property
    def sync_id(self) -> int:
        """Identifier of the SYNC, object 1005h."""
        return int(self.dictionary.value(SYNC_ID)) & 0x7FF

    @property
    def node_id(self) -> int:
        """Node-ID."""
        return self.dictionary.node_id

    def start(self) -> None:
        """Power up: stored parameters, boot-up message, pre-operational."""
        self._reset(whole=True)
        self.nmt.boot()

    def die(self) -> None:
        """Stop sending and receiving, for good."""
        self.mute = True
        self.nmt.alive = False
        self.rpdos, self._on_sync, self._on_event, self._buffered = [], [], [], []
        self.on_routes()

    def _send(self, can_id: int, data: bytes) -> None:
        if not self.mute:
            self._bus(can_id, data)

    # --- the cycle --------------------------------------------------------------------------------

    def activate(self) -> None:
        """SYNC, outputs: the buffered RPDOs take effect."""
        fresh = False
        for rpdo in self._buffered:
            fresh |= rpdo.activate()
        if fresh:
            self._device.process()

    def sample(self) -> None:
        """SYNC, inputs: send the synchronous TPDOs."""
        for tpdo in self._on_sync:
            tpdo.on_sync()

    def run(self) -> None:
        """Serve what depends on time: heartbeats, emergencies, event-driven TPDOs, RPDO time-outs."""
        if not self.nmt.alive:
            return
        now_us = self._clock.now_us
        if now_us >= self.nmt.due_us:
            self.nmt.run()
        if now_us >= self.heartbeats.due_us:
            self.heartbeats.run()
        if self.emergency.waiting:
            self.emergency.flush(now_us)
        for tpdo in self._on_event:
            tpdo.on_event_check(now_us)
        for rpdo in self._timed:
            if now_us >= rpdo.deadline_us:
                rpdo.deadline_us = NEVER_US  # armed again by the next frame
                self.emergency.report(emcy.RPDO_TIMEOUT, emcy.COMMUNICATION)

    # --- frames -----------------------------------------------------------------------------------

    def on_rpdo(self, rpdo: Rpdo, data: bytes) -> None:
        """Receive a frame of an RPDO; asynchronous ones act at once."""
        if rpdo.event_timer_us:
            rpdo.deadline_us = self._clock.now_us + rpdo.event_timer_us
            self.emergency.clear(emcy.RPDO_TIMEOUT)
        if rpdo.receive(data):
            self._device.process()

    def on_sdo(self, data: bytes) -> None:
        """Serve an SDO frame, unless the node is stopped."""
        if self.nmt.alive and self.nmt.state in COMMUNICATING:
            self.dictionary.server.on_request(0, data, 0.0)

    def on_sync_length(self, length: int) -> None:
        """Report a SYNC with data; clear the error at the first one without."""
        if length:
            self.emergency.report(emcy.SYNC_LENGTH, emcy.COMMUNICATION, bytes((length,)))
        else:
            self.emergency.clear(emcy.SYNC_LENGTH)

    def on_overrun(self) -> None:
        """Report lost frames: an event, so its end is reported at once."""
        self.emergency.report(emcy.OVERRUN, emcy.COMMUNICATION)
        self.emergency.clear(emcy.OVERRUN)

    # --- changes ----------------------------------------------------------------------------------

    def _configure_pdos(self) -> None:
        self.emergency.clear(emcy.PDO_TOO_SHORT, emcy.PDO_TOO_LONG, emcy.RPDO_TIMEOUT)
        operational = self.nmt.state == NmtState.OPERATIONAL
        self.rpdos = self._pdos.rpdos(self._wrong_length) if operational else []
        tpdos = self._pdos.tpdos(self._transmit) if operational else []
        self._buffered = [rpdo for rpdo in self.rpdos if rpdo.synchronous]
        self._timed = [rpdo for rpdo in self.rpdos if rpdo.event_timer_us]
        self._on_sync = [tpdo for tpdo in tpdos if tpdo.synchronous]
        self._on_event = [tpdo for tpdo in tpdos if not tpdo.synchronous]
        self.on_routes()

    def _watch(self) -> None:
        self.heartbeats.follow()
        self.on_routes()

    def _wrong_length(self, number: int, size: int, expected: int) -> None:
        if size == expected:
            self.emergency.clear(emcy.PDO_TOO_SHORT, emcy.PDO_TOO_LONG)
            return
        code = emcy.PDO_TOO_SHORT if size < expected else emcy.PDO_TOO_LONG
        self.emergency.report(code, emcy.COMMUNICATION, bytes((number, size, expected)))

    def _heartbeat_lost(self, node: int) -> None:
        self.emergency.report(emcy.HEARTBEAT_LOST, emcy.COMMUNICATION, bytes((node,)))
        self._device.connection_lost(emcy.HEARTBEAT_LOST)
        target = ON_COMMUNICATION_ERROR.get(self.dictionary.value(0x1029, 1))
        if target is not None and self.nmt.state == NmtState.OPERATIONAL:
            self.nmt.enter(target)

    def _state_changed(self, _old: NmtState, new: NmtState) -> None:
        self.emergency.enabled = new in COMMUNICATING
        self.dictionary.server.abandon_transfer()
        if new == NmtState.STOPPED:
            self._device.connection_lost(0)
        self._configure_pdos()

    def _reset(self, whole: bool) -> None:
        last = 0xFFFF if whole else 0x1FFF
        self._device.connection_lost(0)
        self.dictionary.load_defaults(0x1000, last)
        if whole:
            self._device.factory_settings()
        self._storage.load(0x1000, last)
        self.heartbeats.follow()
        if whole:
            self.emergency.reset()
            self._device.reset()
