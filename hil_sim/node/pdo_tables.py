"""The synchronous PDOs of all nodes as tables for the compiled exchange."""

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from can_frames.frame import DATA_AT, FRAME
from hil_sim.cyclic.pdo_step import DRIVES_ACT, Bytes, MappedPlace, fill, mapped_places
from hil_sim.cyclic.pdo_step import exchange as exchange_all
from hil_sim.node.pdo import FORMATS, MappedObject, Rpdo, Tpdo
from hil_sim.node.slave import Slave
from kernels.arrays import Array, Index
from kernels.jit import ready_for

UNSETTLED = -1
"""Size of an RPDO that is not received here: no frame has it."""


class PdoTables:
    """The PDOs of `slaves`, whose objects are in `numbers`, those of each node from its index in `first` on.

    `drives`: the drives among them, in the order of their axes.

    Raises:
        ValueError: a PDO is not possible in a table: another transmission type, a computed object.
    """

    def __init__(
        self, slaves: Sequence[Slave], numbers: Array, first: Sequence[int], drives: Sequence[Slave]
    ) -> None:
        self._numbers = numbers
        received: list[MappedPlace] = []
        sent: list[MappedPlace] = []
        self._rpdos: list[Rpdo] = []
        drive_of: list[int] = []
        self._tpdos: list[Tpdo] = []
        for slave, begin in zip(slaves, first, strict=True):
            values = slave.dictionary.objects.VALUES
            places = {name: begin + value.place for name, value in values.items()}
            for rpdo in slave.pdos.rpdos:
                if rpdo.synchronous:
                    received += _entries(len(self._rpdos), rpdo.mapping, places)
                    self._rpdos.append(rpdo)
                    drive_of.append(drives.index(slave) if slave in drives else -1)
            for tpdo in slave.pdos.synchronous:
                if not tpdo.cyclic:
                    raise ValueError(f"TPDO {tpdo.cob_id:03X}h is not sent at every n-th SYNC")
                sent += _entries(len(self._tpdos), tpdo.mapping, places)
                self._tpdos.append(tpdo)
        self._received, self._sent = mapped_places(received), mapped_places(sent)
        self._drive_of: Index = np.array(drive_of, np.int64)
        self.acting: NDArray[np.bool_] = np.zeros(len(drives), np.bool_)
        """Drives that must act on new object values."""
        self.sizes: Index = np.zeros(len(self._rpdos), np.int64)
        """Bytes of each RPDO; `UNSETTLED` while a wrong length is reported."""
        self.data: Bytes = np.zeros((len(self._rpdos), 8), np.uint8)
        self.arrived: NDArray[np.bool_] = np.zeros(len(self._rpdos), np.bool_)
        """Data received since the last SYNC, and whether each RPDO arrived."""
        headers = [list(FRAME.pack(tpdo.cob_id, tpdo.size, b"")[:DATA_AT]) for tpdo in self._tpdos]
        self._headers: Bytes = np.array(headers, np.uint8).reshape(-1, DATA_AT)
        turns = [(tpdo.every, tpdo.syncs) for tpdo in self._tpdos]
        self._turns: Index = np.array(turns, np.int64).reshape(-1, 2)
        self._frames: Bytes = np.zeros((len(turns), FRAME.size), np.uint8)
        self._bytes = self._frames.reshape(-1).data
        self._sending = self._sent, self._headers, self._turns, self._frames
        self.memory = numbers, self._received, self._drive_of, self.acting, *self._sending
        """Arguments of `serve_burst`, in its order."""
        self._fill = ready_for(fill, numbers, *self._sending)  # loaded at the first SYNC it would be late
        for rpdo in self._rpdos:
            self.load(rpdo)

    def place(self, rpdo: Rpdo) -> int | None:
        """Return the index of an RPDO; None if it is not received here."""
        return self._rpdos.index(rpdo) if rpdo in self._rpdos and not rpdo.event_timer_us else None

    def load(self, rpdo: Rpdo) -> None:
        """Load the pending frame of an RPDO, and whether a wrong length is reported."""
        if rpdo not in self._rpdos:
            return
        place = self._rpdos.index(rpdo)
        self.sizes[place] = UNSETTLED if rpdo.wrong_length else rpdo.size
        if rpdo.pending is not None:
            self.data[place, : rpdo.size] = memoryview(rpdo.pending)
            self.arrived[place] = True
            rpdo.pending = None

    def unload(self) -> None:
        """Return pending frames and SYNC counts to the PDOs, before the tables are replaced."""
        for tpdo, (_every, syncs) in zip(self._tpdos, self._turns.tolist(), strict=True):
            tpdo.syncs = syncs
        for place, rpdo in enumerate(self._rpdos):
            if self.arrived[place]:
                rpdo.pending = self.data[place, : rpdo.size].tobytes()

    def exchange(self, axes: Any, objects: Any) -> bytes | None:
        """Let received RPDOs take effect; return the TPDO frames, None if a drive must act first."""
        received = self._received, self.data, self.arrived, self._drive_of, self.acting
        count = exchange_all(self._numbers, axes, objects, *received, *self._sending)
        return None if count == DRIVES_ACT else self.filled(count)

    def filled(self, count: int) -> bytes:
        """Return the first `count` frames that the last exchange filled."""
        return bytes(self._bytes[: FRAME.size * count])

    def fill(self) -> bytes:
        """Return the TPDO frames of this SYNC with the present object values, node by node."""
        return self.filled(self._fill(self._numbers, *self._sending))


def _entries(pdo: int, mapping: Sequence[MappedObject], places: dict[str, int]) -> list[MappedPlace]:
    start, entries = 0, []
    for item in mapping:
        code = FORMATS[item.data_type]
        size = struct.calcsize(code)
        if item.attribute is not None:
            if item.attribute not in places:
                raise ValueError(f"{item.attribute} is computed")
            place = places[item.attribute]
            entries.append(
                MappedPlace(
                    pdo=pdo,
                    start=start,
                    size=size,
                    signed=code.islower(),
                    place=place,
                    low=item.low,
                    high=item.high,
                )
            )
        start += size
    return entries
