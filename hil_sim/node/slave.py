"""One CANopen slave: its services and their connections to the device."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from hil_sim.node import emcy
from hil_sim.node.bit_timing import NodeRate
from hil_sim.node.dictionary import Dictionary
from hil_sim.node.emcy import EmergencyProducer
from hil_sim.node.heartbeat_consumer import HeartbeatConsumer
from hil_sim.node.identifiers import check_sync
from hil_sim.node.lss_slave import UNNAMED, LssSlave, store_lss, stored_lss
from hil_sim.node.nmt import NmtSlave, NmtState
from hil_sim.node.node_host import Device, NodeHost
from hil_sim.node.pdo import Rpdo
from hil_sim.node.pdo_exchange import PdoExchange
from hil_sim.node.process_objects import ProcessObjects
from hil_sim.node.sdo_server import SdoServer
from hil_sim.node.storage import Storage, verify_configuration
from hil_sim.node.supervision import Supervision

IDENTITY, SERIAL = 0x1018, 4
STATUS, SYNC_ID, WATCHED_NODES = 0x1002, 0x1005, 0x1016
COMMUNICATING = {NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL}
ON_COMMUNICATION_ERROR = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}
"""Error behaviour 1029h:01: the state to enter; 1 changes nothing."""


class Slave:
    """Services of node `node_id`, which is UNNAMED until LSS assigns an id.

    It calls `on_routes` when the identifiers that it receives have changed.

    Raises:
        OSError, ValueError: the EDS cannot be read, or belongs to another profile.
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
        serial = host.serial_of(node_id)
        name = f"node_{node_id}" if node_id != UNNAMED else f"serial_{serial:08X}"
        self._lss_file = host.state_directory and host.state_directory / f"{name}_id.json"
        stored = stored_lss(self._lss_file)
        self.node_id = node_id = node_id if stored.node_id is None else stored.node_id
        self.rate = NodeRate(host.bus_rate, stored.bit_rate_kbit_s)
        self._mute = self.off_rate = False
        """Whether a fault prevents sending; whether another bit rate keeps the node off the bus."""
        self.on_routes: Callable[[], None] = lambda: None
        self._device, self._host = device, host
        self.dictionary = Dictionary(node_id, eds, objects, inside_eds)
        profile = self.dictionary.value(0x1000) & 0xFFFF
        if profile != device.profile:
            raise ValueError(f"device profile {profile}, not {device.profile}")
        self.emergency = EmergencyProducer(self.dictionary, self._send)
        recovered = partial(self.emergency.clear, emcy.HEARTBEAT_LOST)
        self.heartbeats = HeartbeatConsumer(self.dictionary, host.clock, self._heartbeat_lost, recovered)
        self.nmt = NmtSlave(self.dictionary, host.clock, self._send, self._state_changed, self._reset)
        self.sdo = SdoServer(self.dictionary, self._send)
        self.pdos = PdoExchange(self.dictionary, self.emergency, self._send, self._configure_pdos)
        self.supervision = Supervision(
            self.dictionary, host.clock, self._lost, self.emergency.clear, self._configure_pdos
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
        """Identifier of the SYNC frame, object 1005h."""
        return int(self.dictionary.value(SYNC_ID)) & 0x7FF

    def start(self) -> None:
        """Power up: load stored parameters, send the boot-up message, enter pre-operational."""
        self._reset(whole=True)
        self.nmt.boot()

    def identity(self) -> tuple[int, int, int, int]:
        """Return vendor, product, revision and serial number, 1018h: the LSS address."""
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

    def serves_lss(self) -> bool:
        """Return whether it serves LSS (CiA 305): not while operational."""
        return self.nmt.alive and self.nmt.state != NmtState.OPERATIONAL

    def start_named(self) -> None:
        """Start with the node id that LSS has assigned."""
        self._reset(whole=False)
        self.nmt.boot()

    def store_lss(self, node_id: int, rate_kbit_s: int) -> bool:
        """Store id and bit rate, without a directory for this process only; return whether that worked."""
        return self._lss_file is None or store_lss(self._lss_file, node_id, rate_kbit_s)

    def bit_rate_kbit_s(self) -> int:
        """Return its bit rate in kbit/s."""
        return self.rate.kbit_s

    def switch_rate(self, rate_kbit_s: int, delay_ms: int) -> None:
        """Switch to a bit rate after a delay, and send nothing for another delay (CiA 305)."""
        self.rate.switch(rate_kbit_s, delay_ms, self._host.clock.now_us)
        self.on_routes()

    def die(self) -> None:
        """Stop sending and receiving for the rest of the run."""
        self.mute = True
        self.nmt.alive = False
        self.pdos.configure(operational=False)
        self.on_routes()

    def _send(self, can_id: int, data: bytes) -> None:
        if not (self._mute or self.off_rate):
            self._host.send(can_id, data)

    # --- the cycle --------------------------------------------------------------------------------

    def activate(self) -> None:
        """Let the buffered RPDOs take effect, at a SYNC."""
        if self.pdos.activate():
            self._device.process()

    def run(self) -> None:
        """Serve all timers: heartbeats, emergencies, event-driven TPDOs, RPDO time-outs, the bit rate."""
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
        """Receive a frame of an RPDO; an asynchronous one takes effect at once."""
        if self.pdos.receive(rpdo, data, self._host.clock.now_us):
            self._device.process()

    def on_sdo(self, data: bytes) -> None:
        """Serve an SDO request, unless the node is stopped."""
        if self.nmt.alive and self.nmt.state in COMMUNICATING:
            self.sdo.on_request(data)

    def on_sync_data(self, data: bytes) -> None:
        """Check the length of a SYNC frame and take its counter; the next right length ends the error."""
        if self.supervision.sync.length_is_right(data):
            self.emergency.clear(emcy.SYNC_LENGTH)
        else:
            self.emergency.report(emcy.SYNC_LENGTH, emcy.COMMUNICATION, bytes((len(data),)))

    def on_guarding(self) -> None:
        """Answer the remote frame of node guarding."""
        if self.nmt.alive and (answer := self.supervision.guarded(self.nmt.state)) is not None:
            self._send(self.nmt.cob_id, answer)

    def on_overrun(self) -> None:
        """Report lost frames by EMCY."""
        self._report_event(emcy.OVERRUN)

    def on_restart(self) -> None:
        """Report the recovery from bus-off by EMCY."""
        self._report_event(emcy.BUS_OFF_RECOVERED)

    def _report_event(self, code: int) -> None:
        """Report an error that is already over, and its end."""
        self.emergency.report(code, emcy.COMMUNICATION)
        self.emergency.clear(code)

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
        """React to a lost master, SYNC or neighbour; 1029h applies to the first two."""
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
