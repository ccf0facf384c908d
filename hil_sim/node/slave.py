"""One CANopen slave: its services, wired to the device whose objects they carry."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

from hil_sim.node import emcy
from hil_sim.node.bit_timing import BusRate, NodeRate
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.emcy import EmergencyProducer
from hil_sim.node.heartbeat_consumer import HeartbeatConsumer
from hil_sim.node.identifiers import check_sync
from hil_sim.node.lss_slave import UNNAMED, LssSlave
from hil_sim.node.named_node import store_lss, stored_lss
from hil_sim.node.nmt import Clock, NmtSlave, NmtState
from hil_sim.node.pdo import Rpdo
from hil_sim.node.pdo_exchange import PdoExchange
from hil_sim.node.process_objects import ProcessObjects
from hil_sim.node.sdo_server import SdoServer
from hil_sim.node.storage import Storage
from hil_sim.node.supervision import Supervision
from hil_sim.node.verify_configuration import verify_configuration

IDENTITY, SERIAL = 0x1018, 4
FIRST_SERIAL, FIRST_UNNAMED_SERIAL = 0x0001_0000, 0x0001_0100
"""Serial numbers of the simulated devices count from here by their node id in the plant file, or by their
place in it where they have none: no two on a bus have the same.
"""
STATUS, SYNC_ID, WATCHED_NODES = 0x1002, 0x1005, 0x1016
COMMUNICATING = {NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL}
ON_COMMUNICATION_ERROR = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}  # 1029h.1; 1 changes nothing


class NodeHost(NamedTuple):
    """What all nodes of a bench share."""

    clock: Clock
    send: Callable[[int, bytes], None]
    """Puts a frame (identifier, data) on the bus."""
    state_directory: Path | None
    """Where stored parameters are kept; None keeps them in memory only."""
    unnamed: Iterator[int]
    """Counts the devices without a node id."""
    bus_rate: BusRate


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

    def manufacturer_status(self) -> int:
        """The upper 16 bits of 1002h, which each device has its own meaning for."""


class Slave:
    """Services of node `node_id`, UNNAMED until LSS gives it one.

    It calls `on_routes` when the identifiers that it receives have changed.

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
        host: NodeHost,
        inside_eds: Path | None = None,
    ) -> None:
        serial = FIRST_SERIAL + node_id if node_id != UNNAMED else FIRST_UNNAMED_SERIAL + next(host.unnamed)
        name = f"node_{node_id}" if node_id != UNNAMED else f"serial_{serial:08X}"
        self._name_file = host.state_directory and host.state_directory / f"{name}_id.json"
        given = stored_lss(self._name_file)
        self.node_id = node_id = node_id if given.node_id is None else given.node_id
        self.rate = NodeRate(host.bus_rate, given.bit_rate_kbit_s)
        self._mute = self.deaf = False
        """Whether its frames are kept off the bus: by a fault; at another bit rate, when it hears nothing."""
        self.on_routes: Callable[[], None] = lambda: None
        self._device = device
        self._host = host
        self.dictionary = Dictionary(node_id, eds, objects, inside_eds)
        described = self.dictionary.value(0x1000) & 0xFFFF
        if described != device.profile:
            raise ValueError(f"device profile {described}, not {device.profile}")
        self.emergency = EmergencyProducer(self.dictionary, self._send)
        self.heartbeats = HeartbeatConsumer(
            self.dictionary,
            host.clock,
            self._heartbeat_lost,
            lambda: self.emergency.clear(emcy.HEARTBEAT_LOST),
        )
        self.nmt = NmtSlave(self.dictionary, host.clock, self._send, self._state_changed, self._reset)
        self.sdo = SdoServer(self.dictionary, self._send)
        self.pdos = PdoExchange(self.dictionary, self.emergency, self._send, self._configure_pdos)
        self.supervision = Supervision(
            self.dictionary,
            host.clock,
            self._lost,
            self.emergency.clear,
            self._configure_pdos,
        )
        self.dictionary.checks[SYNC_ID] = check_sync
        self.dictionary.readers[IDENTITY] = lambda sub: serial if sub == SERIAL else None
        self.dictionary.followers[SYNC_ID] = lambda _sub: self.on_routes()
        self.dictionary.followers[WATCHED_NODES] = lambda _sub: self._watch()
        self.dictionary.readers[STATUS] = lambda _sub: device.manufacturer_status() << 16 | self.nmt.state
        verify_configuration(self.dictionary)
        file = host.state_directory and host.state_directory / f"{name}.json"
        self._storage = Storage(self.dictionary, file, device.is_idle)
        self.lss = LssSlave(self, self._send)

    @property
    def sync_id(self) -> int:
        """Identifier of the SYNC, object 1005h."""
        return int(self.dictionary.value(SYNC_ID)) & 0x7FF

    def start(self) -> None:
        """Power up: stored parameters, boot-up message, pre-operational."""
        self._reset(whole=True)
        self.nmt.boot()

    def identity(self) -> tuple[int, int, int, int]:
        """Vendor, product, revision and serial number, 1018h: the LSS address."""
        vendor, product, revision, serial = (self.dictionary.value(IDENTITY, sub) for sub in range(1, 5))
        return vendor, product, revision, serial

    @property
    def mute(self) -> bool:
        """Whether a fault keeps its frames off the bus."""
        return self._mute

    @mute.setter
    def mute(self, mute: bool) -> None:
        self._mute = mute
        self.on_routes()

    def may_be_named(self) -> bool:
        """Whether LSS is served (CiA 305): not while operational."""
        return self.nmt.alive and self.nmt.state != NmtState.OPERATIONAL

    def take_node_id(self) -> None:
        """Start with the id that LSS has given."""
        self._reset(whole=False)
        self.nmt.boot()

    def store_lss(self, node_id: int, rate_kbit_s: int) -> bool:
        """Keep id and bit rate over a power cycle; without a directory they last as long as the process."""
        return self._name_file is None or store_lss(self._name_file, node_id, rate_kbit_s)

    def bit_rate_kbit_s(self) -> int:
        """Its bit rate."""
        return self.rate.kbit_s

    def switch_rate(self, rate_kbit_s: int, delay_ms: int) -> None:
        """Take a bit rate after a delay, and be silent as long again."""
        self.rate.switch(rate_kbit_s, delay_ms, self._host.clock.now_us)
        self.on_routes()

    def die(self) -> None:
        """Stop sending and receiving, for good."""
        self.mute = True
        self.nmt.alive = False
        self.pdos.configure(operational=False)
        self.on_routes()

    def _send(self, can_id: int, data: bytes) -> None:
        if not (self._mute or self.deaf):
            self._host.send(can_id, data)

    # --- the cycle --------------------------------------------------------------------------------

    def activate(self) -> None:
        """SYNC, outputs: the buffered RPDOs take effect."""
        if self.pdos.activate():
            self._device.process()

    def run(self) -> None:
        """Serve what depends on time: heartbeats, emergencies, event-driven TPDOs, RPDO time-outs."""
        if not self.nmt.alive:
            return
        now_us = self._host.clock.now_us
        if now_us >= self.rate.due_us:
            self.rate.run(now_us)
            self.on_routes()
        if now_us >= self.nmt.due_us:
            self.nmt.run()
        if now_us >= self.heartbeats.due_us:
            self.heartbeats.run()
        if now_us >= self.supervision.due_us:
            self.supervision.run()
        if self.emergency.waiting:
            self.emergency.flush(now_us)
        self.pdos.run(now_us)

    # --- frames -----------------------------------------------------------------------------------

    def on_rpdo(self, rpdo: Rpdo, data: bytes) -> None:
        """Receive a frame of an RPDO; asynchronous ones act at once."""
        if self.pdos.receive(rpdo, data, self._host.clock.now_us):
            self._device.process()

    def on_sdo(self, data: bytes) -> None:
        """Serve an SDO frame, unless the node is stopped."""
        if self.nmt.alive and self.nmt.state in COMMUNICATING:
            self.sdo.on_request(data)

    def on_sync_data(self, data: bytes) -> None:
        """Take the counter of a SYNC; report one of a wrong length, until the first of the right one."""
        if self.supervision.sync.length_is_right(data):
            self.emergency.clear(emcy.SYNC_LENGTH)
        else:
            self.emergency.report(emcy.SYNC_LENGTH, emcy.COMMUNICATION, bytes((len(data),)))

    def on_guarding(self) -> None:
        """Answer the remote frame of node guarding."""
        if self.nmt.alive and (answer := self.supervision.guarded(self.nmt.state)) is not None:
            self._send(self.nmt.cob_id, answer)

    def on_overrun(self) -> None:
        """Report lost frames: an event, so its end is reported at once."""
        self.emergency.report(emcy.OVERRUN, emcy.COMMUNICATION)
        self.emergency.clear(emcy.OVERRUN)

    def on_restart(self) -> None:
        """Report the recovery from bus-off, likewise an event."""
        self.emergency.report(emcy.BUS_OFF_RECOVERED, emcy.COMMUNICATION)
        self.emergency.clear(emcy.BUS_OFF_RECOVERED)

    # --- changes ----------------------------------------------------------------------------------

    def _configure_pdos(self) -> None:
        sync = self.supervision.sync
        counter = (lambda: sync.counter) if sync.counted else None
        self.pdos.configure(self.nmt.state == NmtState.OPERATIONAL, counter)
        self.on_routes()

    def _watch(self) -> None:
        self.heartbeats.follow()
        self.on_routes()

    def _heartbeat_lost(self, node: int) -> None:
        self._lost(emcy.HEARTBEAT_LOST, bytes((node,)))

    def _lost(self, code: int, detail: bytes) -> None:
        """React to a lost master, SYNC or neighbour; 1029h is for the first two."""
        self.emergency.report(code, emcy.COMMUNICATION, detail)
        self._device.connection_lost(code)
        if code == emcy.NEIGHBOUR:
            return
        target = ON_COMMUNICATION_ERROR.get(self.dictionary.value(0x1029, 1))
        if target is not None and self.nmt.state == NmtState.OPERATIONAL:
            self.nmt.enter(target)

    def _state_changed(self, state: NmtState) -> None:
        self.emergency.enabled = state in COMMUNICATING
        self.sdo.abandon_transfer()
        if state == NmtState.STOPPED:
            self._device.connection_lost(0)
        self._configure_pdos()

    def _reset(self, whole: bool) -> None:
        """Reset the communication, or the `whole` node."""
        last = 0xFFFF if whole else 0x1FFF
        self._device.connection_lost(0)
        if self.lss.pending != self.node_id:
            self.node_id = self.lss.pending
            self.dictionary.readdress(self.node_id)
        self.dictionary.load_defaults(0x1000, last)
        if whole:
            self._device.factory_settings()
        self._storage.load(0x1000, last)
        self.heartbeats.follow()
        self.supervision.reset()
        if whole:
            self.emergency.reset()
            self._device.reset()
