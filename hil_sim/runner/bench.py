"""The bench, the same in lockstep and real time: a plant, its nodes, their frames, and its time."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import accumulate, count
from pathlib import Path

import numpy as np

from can_frames.frame import FRAME
from hil_sim.config import ConfigError, PlantConfig, build_plant
from hil_sim.drive.amplifier_device import Drive
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.drives_in_step import DrivesInStep
from hil_sim.drive.personality import PersonalDrive
from hil_sim.faults.fault_target import FaultTarget
from hil_sim.faults.schedule import Fault, Schedule
from hil_sim.node import lss_slave
from hil_sim.node.bit_timing import BusRate
from hil_sim.node.nmt import Clock
from hil_sim.node.node_host import NodeHost
from hil_sim.node.pdo import Rpdo
from hil_sim.node.pdo_tables import PdoTables
from hil_sim.node.sdo_abort import AbortCode, SdoAbort
from hil_sim.node.slave import Slave
from hil_sim.node.storage import StoredParametersError
from hil_sim.scale.encoder_device import LinearScale
from hil_sim.scale.scale_objects import ScaleObjects
from hil_sim.scale.scales_in_step import ScalesInStep

CYCLE_PERIOD = 0x1006
LONGEST_CYCLE_US = 100_000
"""Bounds the communication cycle period (chosen)."""


class SimulatedMachine:
    """Plant and nodes of a machine; `send(can_id, data)` puts a frame on the bus.

    Raises:
        ConfigError: an EDS file is missing or is not one of this device, or stored parameters are damaged.
        FaultError: an axis cannot have one of the faults.
    """

    def __init__(
        self,
        config: PlantConfig,
        send: Callable[[int, bytes], None],
        state_directory: Path | None = None,
        faults: Sequence[Fault] = (),
    ) -> None:
        self.plant = build_plant(config)
        self.clock = Clock()
        self.substep_us = config.substep_us
        self._substeps_per_tick = round(config.drive_tick_ms * 1000.0 / config.substep_us)
        self._substeps = 0
        self._wrong_sync = False
        self.devices: list[Drive | LinearScale] = []
        self.fault_targets: dict[str, FaultTarget] = {}
        bus_rate = BusRate()
        host = NodeHost(self.clock, send, state_directory, count(), bus_rate)
        for index, (name, axis) in enumerate(config.axes.items()):
            with _eds_of(axis.drive.eds, f"axis.{name}.drive.eds"):
                own = axis, self.plant, index, host
                ways = axis.drive.personality
                drive = Drive(*own) if ways is None else PersonalDrive(ways, *own)
            self.devices.append(drive)
            scale = None
            if axis.scale is not None:
                with _eds_of(axis.scale.eds, f"axis.{name}.scale.eds"):
                    scale = LinearScale(axis, self.plant, index, host)
                self.devices.append(scale)
            plant = self.plant
            self.fault_targets[name] = FaultTarget(
                name, drive, scale, plant.params[index], plant.state[index]
            )
        self._lay_out()
        self.devices.sort(key=lambda device: device.slave.node_id)
        self._faults = Schedule(faults, self.fault_targets)
        self.slaves: list[Slave] = [device.slave for device in self.devices]
        bus_rate.kbit_s, _ = Counter(slave.rate.kbit_s for slave in self.slaves).most_common(1)[0]
        self._drives = [device for device in self.devices if isinstance(device, Drive)]
        self.on_sync: Callable[[list[Slave]], None] = lambda _slaves: None
        self.on_async: Callable[[], None] = lambda: None
        self.cycle_us = 1000
        self.send_burst: Callable[[bytes], None] = lambda burst: _send_each(burst, send)
        """Puts frames that lie one behind the other on the bus."""
        self._tables: PdoTables | None = None
        self.routes: dict[int, Callable[[bytes], None]] = {}
        self.remote_routes: dict[int, list[Callable[[], None]]] = {}
        for slave in self.slaves:
            slave.on_routes = self._route
            slave.dictionary.checks[CYCLE_PERIOD] = self._check_cycle
            slave.dictionary.followers[CYCLE_PERIOD] = partial(self._take_cycle, slave)
        self._in_step.warm_up()  # before anything is on the bus
        self._scales.read()
        self._in_step.exchange(PdoTables((), self._numbers, (), self._in_step.slaves))

    def _lay_out(self) -> None:
        """Put records and process objects of all devices side by side, for the compiled tick."""
        drives = [device for device in self.devices if isinstance(device, Drive)]
        scales = [device for device in self.devices if isinstance(device, LinearScale)]
        rows = (len(drives), len(DriveObjects.VALUES)), (len(scales), len(ScaleObjects.VALUES))
        sizes = [count * values for count, values in rows]
        self._numbers = np.zeros(sum(sizes))  # process objects of all devices
        self._in_step = DrivesInStep(drives, self.plant, self._numbers[: sizes[0]].reshape(rows[0]))
        self._scales = ScalesInStep(scales, self.plant, self._numbers[sizes[0] :].reshape(rows[1]))
        in_order: list[Drive | LinearScale] = [*drives, *scales]
        begins = accumulate((len(device.objects.VALUES) for device in in_order), initial=0)
        self._first = dict(zip((device.slave for device in in_order), begins, strict=False))

    def start(self) -> None:
        """Power up all nodes: they send their boot-up messages."""
        for slave in self.slaves:
            slave.start()
        self._take_cycle(self.slaves[0])
        self._route()

    # --- time -------------------------------------------------------------------------------------

    def advance_cycle(self) -> None:
        """Advance by the communication cycle period 1006h."""
        self.advance(round(self.cycle_us / self.substep_us))

    def advance(self, substeps: int) -> None:
        """Advance plant and drives by a number of substeps, in ticks of `drive_tick_ms` at most."""
        ticks = -(-substeps // self._substeps_per_tick)
        for tick in range(ticks):
            self._tick(substeps * (tick + 1) // ticks - substeps * tick // ticks)

    def _tick(self, substeps: int) -> None:
        dt_us = substeps * self.substep_us
        dt_s = dt_us * 1e-6
        following = self._in_step.advance(substeps, self.substep_us * 1e-6, dt_s, dt_us / self.cycle_us)
        self._substeps += substeps
        self.clock.now_us = int(self._substeps * self.substep_us)
        self._in_step.read(dt_s, following=following)
        self._scales.read()
        if self.clock.now_us >= self._faults.due_us:
            self._faults.run(self.clock.now_us)

    def synchronise(self, slaves: list[Slave]) -> None:
        """Serve a SYNC to `slaves` after the advance: outputs take effect, inputs are sent."""
        if self._tables is not None:
            self.send_burst(self._in_step.exchange(self._tables))
        else:
            for slave in slaves:
                slave.activate()
            for slave in slaves:
                slave.pdos.sample()
        self.run_timers()

    def run_timers(self) -> None:
        """Serve heartbeats, emergencies and event-driven PDOs."""
        for slave in self.slaves:
            slave.run()

    def on_overrun(self) -> None:
        """Have every node report that frames were lost on their way here."""
        for slave in self.slaves:
            slave.on_overrun()

    def on_restart(self) -> None:
        """Have every node report that it was off the bus and has come back."""
        for slave in self.slaves:
            slave.on_restart()

    # --- frames -----------------------------------------------------------------------------------

    def handle(self, can_id: int, data: bytes) -> None:
        """Dispatch one frame from the bus."""
        route = self.routes.get(can_id)
        if route is not None:
            route(data)

    def handle_remote(self, can_id: int) -> None:
        """Answer a remote frame."""
        if can_id in self.remote_routes:
            self.on_async()
            for answer in self.remote_routes[can_id]:
                answer()

    def _route(self) -> None:
        """Collect the handlers of the identifiers that the nodes receive."""
        routes: dict[int, list[Callable[[bytes], None]]] = {0x000: [self._nmt]}
        remote: dict[int, list[Callable[[], None]]] = {}
        for slave in self.slaves:
            slave.deaf = slave.rate.deaf
        hearing = [slave for slave in self.slaves if not slave.deaf]
        for sync_id in {slave.sync_id for slave in self.slaves}:
            listeners = [slave for slave in hearing if slave.sync_id == sync_id]
            watched = any(slave.supervision.sync.watches for slave in listeners)
            routes[sync_id] = [partial(self._watched_sync if watched else self._sync, listeners)]
        routes[lss_slave.REQUEST] = [slave.lss.on_request for slave in hearing]
        for slave in hearing:
            remote.setdefault(slave.nmt.cob_id, []).append(slave.on_guarding)
            for tpdo in slave.pdos.on_request:
                remote.setdefault(tpdo.cob_id, []).append(tpdo.on_request)
            for can_id, take in slave.supervision.routes():
                routes.setdefault(can_id, []).append(partial(self._timely, take))
            routes.setdefault(slave.sdo.request_id, []).append(partial(self._sdo, slave))
            for rpdo in slave.pdos.rpdos:
                routes.setdefault(rpdo.cob_id, []).append(partial(self._rpdo, slave, rpdo))
            for node in slave.heartbeats.watched:
                routes.setdefault(0x700 + node, []).append(partial(self._heartbeat, slave, node))
        self.routes = {can_id: single(handlers) for can_id, handlers in routes.items()}
        if self._tables is not None:
            self._tables.give_back()
        self._tables = self._tables_of_all()
        self.remote_routes = remote

    def _tables_of_all(self) -> PdoTables | None:
        """The PDOs of all nodes for the compiled exchange; None where it cannot have one of them."""
        alike = len({slave.sync_id for slave in self.slaves}) == 1
        if not alike or any(slave.mute or slave.deaf for slave in self.slaves):
            return None
        try:
            first = [self._first[slave] for slave in self.slaves]
            return PdoTables(self.slaves, self._numbers, first, self._in_step.slaves)
        except ValueError:
            return None

    def _nmt(self, data: bytes) -> None:
        for slave in self.slaves:
            if not slave.deaf:
                slave.nmt.on_command(data)

    def _sync(self, listeners: list[Slave], data: bytes) -> None:
        if data or self._wrong_sync:
            self._wrong_sync = bool(data)
            for slave in listeners:
                slave.on_sync_data(data)
        self.on_sync(listeners)

    def _watched_sync(self, listeners: list[Slave], data: bytes) -> None:
        """A SYNC with nodes that look at its counter or its time."""
        for slave in listeners:
            slave.on_sync_data(data)
        self.on_sync(listeners)
        for slave in listeners:
            slave.supervision.on_sync()

    def _timely(self, take: Callable[[bytes], None], data: bytes) -> None:
        self.on_async()  # as for a heartbeat: the time of the frame is now
        take(data)

    def _sdo(self, slave: Slave, data: bytes) -> None:
        slave.on_sdo(data)
        if slave.emergency.waiting:
            slave.run()

    def _rpdo(self, slave: Slave, rpdo: Rpdo, data: bytes) -> None:
        if not rpdo.synchronous:
            self.on_async()
        elif slave.supervision.sync.window_us:
            self.on_async()
            if not slave.supervision.sync.in_window():
                return
        slave.on_rpdo(rpdo, data)

    def _heartbeat(self, slave: Slave, node: int, _data: bytes) -> None:
        self.on_async()  # its time counts from now, not from the last SYNC
        slave.heartbeats.on_heartbeat(node)

    def _check_cycle(self, _subindex: int, value: int) -> None:
        """Refuse a cycle that is no whole number of substeps, or longer than LONGEST_CYCLE_US."""
        if value and (value % self.substep_us or not self.substep_us <= value <= LONGEST_CYCLE_US):
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

    def _take_cycle(self, slave: Slave, _subindex: int = 0) -> None:
        """Set the one cycle of the bench: the last period written to any node; 0 changes nothing."""
        self.cycle_us = slave.dictionary.value(CYCLE_PERIOD) or self.cycle_us


def _send_each(burst: bytes, send: Callable[[int, bytes], None]) -> None:
    for can_id, size, data in FRAME.iter_unpack(burst):
        send(can_id, data[:size])


@contextmanager
def _eds_of(eds: Path, key: str) -> Iterator[None]:
    """Make a ConfigError of whatever goes wrong with a device: its EDS file, or its stored parameters."""
    try:
        yield
    except StoredParametersError as error:
        raise ConfigError(error.file, "", f"stored parameters: {error.reason}") from error
    except OSError as error:
        raise ConfigError(eds, key, error.strerror or "cannot be read") from error
    except Exception as error:  # canopen's importer raises whatever a broken file leads to
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ConfigError(eds, key, f"no usable EDS of this device: {reason}") from error


def single(handlers: list[Callable[[bytes], None]]) -> Callable[[bytes], None]:
    """One handler for an identifier that several nodes may listen to."""
    if len(handlers) == 1:
        return handlers[0]

    def each(data: bytes) -> None:
        for handler in handlers:
            handler(data)

    return each
