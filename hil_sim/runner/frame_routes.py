"""Routes identifiers to the handlers of all nodes, and marks those that the compiled call serves itself."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from can_frames.frame import LARGEST_STANDARD
from hil_sim.cyclic.burst_step import BY_CALLER, FIRST_RPDO, NO_RECEIVER, SYNC
from hil_sim.node import lss_slave
from hil_sim.node.pdo import Rpdo
from hil_sim.node.pdo_tables import PdoTables
from hil_sim.node.slave import Slave
from kernels.arrays import Index

Handler = Callable[[bytes], None]


class FrameRoutes:
    """Handlers of identifiers; `on_sync(listeners)` serves a SYNC, `on_async` precedes a timed frame."""

    def __init__(self, slaves: Sequence[Slave]) -> None:
        self._slaves = tuple(slaves)
        self.on_sync: Callable[[list[Slave]], None] = lambda _slaves: None
        self.on_async: Callable[[], None] = lambda: None
        self.routes: dict[int, Handler] = {}
        self.remote: dict[int, list[Callable[[], None]]] = {}
        self.kinds: Index = np.zeros(LARGEST_STANDARD + 1, np.int64)
        """Kind of each identifier, see `burst_step`."""
        self.wrong_sync = False
        """Whether the last SYNC had data, so that a correct one ends an error."""
        self._tables: PdoTables | None = None

    def handle(self, can_id: int, data: bytes) -> None:
        """Dispatch one frame."""
        route = self.routes.get(can_id)
        if route is not None:
            route(data)

    def handle_remote(self, can_id: int) -> None:
        """Answer a remote frame."""
        if can_id in self.remote:
            self.on_async()
            for answer in self.remote[can_id]:
                answer()

    def update(self, tables: PdoTables | None) -> None:
        """Collect the handlers of the identifiers that the nodes receive; `tables` of their PDOs, if any."""
        self._tables = tables
        routes: dict[int, list[Handler]] = {0x000: [self._nmt]}
        remote: dict[int, list[Callable[[], None]]] = {}
        kinds: dict[int, int] = {}
        receivers = [slave for slave in self._slaves if not slave.off_rate]
        for sync_id in {slave.sync_id for slave in self._slaves}:
            listeners = [slave for slave in receivers if slave.sync_id == sync_id]
            watched = any(slave.supervision.sync.watches for slave in listeners)
            routes[sync_id] = [partial(self._watched_sync if watched else self._sync, listeners)]
            kinds[sync_id] = BY_CALLER if watched else SYNC
        routes[lss_slave.REQUEST] = [slave.lss.on_request for slave in receivers]
        for slave in receivers:
            remote.setdefault(slave.nmt.cob_id, []).append(slave.on_guarding)
            for tpdo in slave.pdos.on_request:
                remote.setdefault(tpdo.cob_id, []).append(tpdo.on_request)
            for can_id, handle in slave.supervision.routes():
                routes.setdefault(can_id, []).append(partial(self._asynchronous, handle))
            routes.setdefault(slave.sdo.request_id, []).append(partial(self._sdo, slave))
            for rpdo in slave.pdos.rpdos:
                routes.setdefault(rpdo.cob_id, []).append(partial(self._rpdo, slave, rpdo))
                place = None if tables is None else tables.place(rpdo)
                if place is not None and not slave.supervision.sync.window_us:
                    kinds[rpdo.cob_id] = FIRST_RPDO + place
            for node in slave.heartbeats.watched:
                routes.setdefault(0x700 + node, []).append(partial(self._heartbeat, slave, node))
        self.routes = {can_id: single(handlers) for can_id, handlers in routes.items()}
        self.remote = remote
        self.kinds[:] = NO_RECEIVER
        for can_id, handlers in routes.items():
            alone = tables is not None and len(handlers) == 1
            self.kinds[can_id] = kinds.get(can_id, BY_CALLER) if alone else BY_CALLER

    def _nmt(self, data: bytes) -> None:
        for slave in self._slaves:
            if not slave.off_rate:
                slave.nmt.on_command(data)

    def _sync(self, listeners: list[Slave], data: bytes) -> None:
        if data or self.wrong_sync:
            self.wrong_sync = bool(data)
            for slave in listeners:
                slave.on_sync_data(data)
        self.on_sync(listeners)

    def _watched_sync(self, listeners: list[Slave], data: bytes) -> None:
        """Serve a SYNC for nodes of which any supervises its counter or time."""
        for slave in listeners:
            slave.on_sync_data(data)
        self.on_sync(listeners)
        for slave in listeners:
            slave.supervision.on_sync()

    def _asynchronous(self, handle: Callable[[bytes], None], data: bytes) -> None:
        self.on_async()  # its time is now, not that of the last SYNC
        handle(data)

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
        if self._tables is not None:
            self._tables.load(rpdo)

    def _heartbeat(self, slave: Slave, node: int, _data: bytes) -> None:
        self.on_async()  # its time is now, not that of the last SYNC
        slave.heartbeats.on_heartbeat(node)


def single(handlers: list[Callable[[bytes], None]]) -> Callable[[bytes], None]:
    """Return one handler for an identifier that several nodes may receive."""
    if len(handlers) == 1:
        return handlers[0]

    def each(data: bytes) -> None:
        for handler in handlers:
            handler(data)

    return each
