"""The bench of lockstep and real time: a plant, its nodes, their frames, and simulated time."""

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate, count
from pathlib import Path

import numpy as np

from can_frames.frame import FRAME, FRAME_BYTES, pack_frame
from hil_sim.config import PlantConfig, build_plant
from hil_sim.cyclic.burst_step import BURST_DONE, FRAME_FOR_CALLER, NO_SYNC, SYNC_DONE, TICK_HAS_FINDING
from hil_sim.drive.amplifier_device import Drive
from hil_sim.drive.bench_drives import BenchDrives
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.faults.schedule import Fault, Schedule
from hil_sim.node.bit_timing import BusRate
from hil_sim.node.nmt import Clock
from hil_sim.node.node_host import NodeHost
from hil_sim.node.pdo_tables import PdoTables
from hil_sim.node.sdo_abort import AbortCode, SdoAbort
from hil_sim.node.slave import Slave
from hil_sim.runner.burst_server import BurstServer
from hil_sim.runner.devices import Device, make_devices
from hil_sim.runner.frame_routes import FrameRoutes
from hil_sim.scale.bench_scales import BenchScales
from hil_sim.scale.encoder_device import LinearScale
from hil_sim.scale.scale_objects import ScaleObjects

CYCLE_PERIOD = 0x1006
LONGEST_CYCLE_US = 100_000
"""Bounds the communication cycle period (chosen)."""
LONGEST_DATA = 8
"""Bytes of a classic CAN frame."""


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
        bus_rate = BusRate()
        host = NodeHost(self.clock, send, state_directory, count(), bus_rate)
        self.devices, self.fault_targets = make_devices(config, self.plant, host)
        self._share_memory()
        self.devices.sort(key=lambda device: device.slave.node_id)
        self._faults = Schedule(faults, self.fault_targets)
        self.slaves: list[Slave] = [device.slave for device in self.devices]
        bus_rate.kbit_s, _ = Counter(slave.rate.kbit_s for slave in self.slaves).most_common(1)[0]
        self.cycle_us = 1000
        self.send_burst: Callable[[bytes], None] = lambda burst: _send_each(burst, send)
        """Sends consecutive packed frames."""
        self._tables: PdoTables | None = None
        self._server: BurstServer | None = None
        self.frames = FrameRoutes(self.slaves)
        self.sync_substeps: Callable[[], int] = lambda: NO_SYNC
        """Returns the substeps by which a SYNC advances time; `on_synced` is called once it is served."""
        self.on_synced: Callable[[int], None] = lambda _substeps: None
        self.on_advanced: Callable[[], None] = lambda: None
        """Called after each advance."""
        for slave in self.slaves:
            slave.on_routes = self._update_routes
            slave.dictionary.checks[CYCLE_PERIOD] = self._check_cycle
            slave.dictionary.followers[CYCLE_PERIOD] = partial(self._set_cycle, slave)
        self._drives.warm_up()  # before anything is on the bus
        self._scales.read()
        none = PdoTables((), self._numbers, (), self._drives.slaves)
        self._drives.exchange(none)
        BurstServer(self._drives, self._scales, none, self.frames.kinds)

    def _share_memory(self) -> None:
        """Move records and process objects of all devices to common arrays, for the compiled tick."""
        drives = [device for device in self.devices if isinstance(device, Drive)]
        scales = [device for device in self.devices if isinstance(device, LinearScale)]
        rows = (len(drives), len(DriveObjects.VALUES)), (len(scales), len(ScaleObjects.VALUES))
        sizes = [count * values for count, values in rows]
        self._numbers = np.zeros(sum(sizes))  # process objects of all devices
        self._drives = BenchDrives(drives, self.plant, self._numbers[: sizes[0]].reshape(rows[0]))
        self._scales = BenchScales(scales, self.plant, self._numbers[sizes[0] :].reshape(rows[1]))
        in_order: list[Device] = [*drives, *scales]
        begins = accumulate((len(device.objects.VALUES) for device in in_order), initial=0)
        self._first = dict(zip((device.slave for device in in_order), begins, strict=False))

    def start(self) -> None:
        """Power up all nodes: they send their boot-up messages."""
        for slave in self.slaves:
            slave.start()
        self._set_cycle(self.slaves[0])
        self._update_routes()

    def advance_cycle(self) -> None:
        """Advance by the communication cycle period 1006h."""
        self.advance(self.substeps_of_cycle())

    def substeps_of_cycle(self) -> int:
        """Substeps of the communication cycle period."""
        return round(self.cycle_us / self.substep_us)

    def advance(self, substeps: int) -> None:
        """Advance plant and drives by a number of substeps, in ticks of `drive_tick_ms` at most."""
        ticks = self._ticks_of(substeps)
        for tick in range(ticks):
            self._tick(substeps * (tick + 1) // ticks - substeps * tick // ticks)
        self.on_advanced()

    def _ticks_of(self, substeps: int) -> int:
        return -(-substeps // self._substeps_per_tick)

    def _advance_clock(self, substeps: int) -> None:
        """Advance the clock with the plant."""
        self._substeps += substeps
        self.clock.now_us = int(self._substeps * self.substep_us)

    def _tick(self, substeps: int) -> None:
        dt_us = substeps * self.substep_us
        dt_s = dt_us * 1e-6
        following = self._drives.advance(substeps, self.substep_us * 1e-6, dt_s, dt_us / self.cycle_us)
        self._advance_clock(substeps)
        self._drives.read(dt_s, following=following)
        self._scales.read()
        if self.clock.now_us >= self._faults.due_us:
            self._faults.run(self.clock.now_us)

    def synchronise(self, slaves: list[Slave]) -> None:
        """Serve a SYNC to `slaves` after the advance: outputs take effect, inputs are sent."""
        if self._tables is not None:
            self.send_burst(self._drives.exchange(self._tables))
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
        """Make every node report that it was bus-off and has recovered."""
        for slave in self.slaves:
            slave.on_restart()

    def handle(self, can_id: int, data: bytes) -> None:
        """Serve one frame from the bus."""
        if len(data) > LONGEST_DATA or not self.serve_burst(pack_frame(can_id, data), 0):
            self.frames.handle(can_id, data)

    def serve_burst(self, burst: bytes | bytearray, start: int) -> int:
        """Serve frames of a burst from byte `start` on; return the start of a frame outside the cycle."""
        while self._server is not None and start < len(burst):
            substeps = self._substeps_of_sync()
            ticks = self._ticks_of(substeps)
            ending, start, number = self._server.serve(
                burst, start, substeps, ticks, substep_us=self.substep_us, cycle_us=float(self.cycle_us)
            )
            if ending == FRAME_FOR_CALLER:
                break
            if ending != BURST_DONE:
                start += FRAME_BYTES
                self._finish_sync(self._server.tables, ending, number, substeps)
        return start

    def _substeps_of_sync(self) -> int:
        """Return the substeps of a SYNC; NO_SYNC if the compiled call cannot serve it."""
        if self.frames.wrong_sync or not (self._drives.following and self._scales.without_cams):
            return NO_SYNC
        substeps = self.sync_substeps()
        end_us = int((self._substeps + substeps) * self.substep_us)
        return NO_SYNC if end_us >= self._faults.due_us else substeps

    def _finish_sync(self, tables: PdoTables, ending: int, number: int, substeps: int) -> None:
        """Complete a SYNC after `serve_burst`, which returned `ending` and this number of frames or ticks."""
        if ending == TICK_HAS_FINDING:
            ticks = self._ticks_of(substeps)
            done = substeps * number // ticks
            self._advance_clock(done)
            self._drives.handle_findings((done - substeps * (number - 1) // ticks) * self.substep_us * 1e-6)
            for tick in range(number, ticks):
                self._tick(substeps * (tick + 1) // ticks - substeps * tick // ticks)
            self.on_advanced()
            self.synchronise(self.slaves)
        else:
            self._advance_clock(substeps)
            self.on_advanced()
            self.send_burst(tables.filled(number) if ending == SYNC_DONE else self._drives.process(tables))
            self.run_timers()
        self.on_synced(substeps)

    def _update_routes(self) -> None:
        """Update routes and tables after a change of the nodes' identifiers."""
        for slave in self.slaves:
            slave.off_rate = slave.rate.is_off_bus
        if self._tables is not None:
            self._tables.unload()
        tables = self._tables = self._tables_of_all()
        self.frames.update(tables)
        self._server = None
        if tables is not None:
            self._server = BurstServer(self._drives, self._scales, tables, self.frames.kinds)

    def _tables_of_all(self) -> PdoTables | None:
        """Return the PDOs of all nodes for the compiled exchange; None if one is not possible there."""
        alike = len({slave.sync_id for slave in self.slaves}) == 1
        if not alike or any(slave.mute or slave.off_rate for slave in self.slaves):
            return None
        try:
            first = [self._first[slave] for slave in self.slaves]
            return PdoTables(self.slaves, self._numbers, first, self._drives.slaves)
        except ValueError:
            return None

    def _check_cycle(self, _subindex: int, value: int) -> None:
        """Refuse a cycle that is not a whole number of substeps, or longer than LONGEST_CYCLE_US."""
        if value and (value % self.substep_us or not self.substep_us <= value <= LONGEST_CYCLE_US):
            raise SdoAbort(AbortCode.VALUE_OUT_OF_RANGE)

    def _set_cycle(self, slave: Slave, _subindex: int = 0) -> None:
        """Set the bench's cycle: the last period written to any node; 0 changes nothing."""
        self.cycle_us = slave.dictionary.value(CYCLE_PERIOD) or self.cycle_us


def _send_each(burst: bytes, send: Callable[[int, bytes], None]) -> None:
    for can_id, size, data in FRAME.iter_unpack(burst):
        send(can_id, data[:size])
