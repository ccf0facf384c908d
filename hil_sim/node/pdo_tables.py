"""The synchronous PDOs of all nodes as tables, where a compiled exchange can have them."""

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

UNSETTLED = -1
"""A size that no frame has."""


class PdoTables:
    """The PDOs of these nodes, whose objects lie in `numbers`, each node's from its place in `first` on.

    `drives`: those of them that are drives, in the order of their axes.

    Raises:
        ValueError: a PDO is none that a table can have: another transmission type, a computed object.
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
                    raise ValueError(f"TPDO {tpdo.cob_id:03X}h does not come at every n-th SYNC")
                sent += _entries(len(self._tpdos), tpdo.mapping, places)
                self._tpdos.append(tpdo)
        self._received, self._sent = mapped_places(received), mapped_places(sent)
        self._drive_of: Index = np.array(drive_of, np.int64)
        self.acts: NDArray[np.bool_] = np.zeros(len(drives), np.bool_)
        """Drives that have something to act on."""
        self.sizes: Index = np.zeros(len(self._rpdos), np.int64)
        """Bytes of each RPDO, `UNSETTLED` while its length is none of a table's business."""
        self.data: Bytes = np.zeros((len(self._rpdos), 8), np.uint8)
        self.came: NDArray[np.bool_] = np.zeros(len(self._rpdos), np.bool_)
        """What has been received since the last SYNC, and of which RPDO there is anything."""
        headers = [list(FRAME.pack(tpdo.cob_id, tpdo.size, b"")[:DATA_AT]) for tpdo in self._tpdos]
        self._headers: Bytes = np.array(headers, np.uint8).reshape(-1, DATA_AT)
        turns = [(tpdo.every, tpdo.syncs) for tpdo in self._tpdos]
        self._turns: Index = np.array(turns, np.int64).reshape(-1, 2)
        self._frames: Bytes = np.zeros((len(turns), FRAME.size), np.uint8)
        self._bytes = self._frames.reshape(-1).data
        self.memory = (
            *(numbers, self._received, self._drive_of, self.acts),
            *(self._sent, self._headers, self._turns, self._frames),
        )
        """For `burst_step`, in its order."""
        for rpdo in self._rpdos:
            self.take(rpdo)

    def place(self, rpdo: Rpdo) -> int | None:
        """Which one it is here; None where a table may not receive it."""
        return self._rpdos.index(rpdo) if rpdo in self._rpdos and not rpdo.event_timer_us else None

    def take(self, rpdo: Rpdo) -> None:
        """Take over what an RPDO has received by itself, and whether its length is settled."""
        if rpdo not in self._rpdos:
            return
        place = self._rpdos.index(rpdo)
        self.sizes[place] = UNSETTLED if rpdo.wrong_length else rpdo.size
        if rpdo.pending is not None:
            self.data[place, : rpdo.size] = memoryview(rpdo.pending)
            self.came[place] = True
            rpdo.pending = None

    def give_back(self) -> None:
        """Let the PDOs know what has come and how many SYNCs have passed, before these tables go."""
        for tpdo, (_every, syncs) in zip(self._tpdos, self._turns.tolist(), strict=True):
            tpdo.syncs = syncs
        for place, rpdo in enumerate(self._rpdos):
            if self.came[place]:
                rpdo.pending = self.data[place, : rpdo.size].tobytes()

    def exchange(self, axes: Any, objects: Any) -> bytes | None:
        """Let what was received take effect; the frames, None where a drive has to act on it before."""
        received = self._received, self.data, self.came, self._drive_of, self.acts
        sent = self._sent, self._headers, self._turns, self._frames
        count = exchange_all(self._numbers, axes, objects, *received, *sent)
        return None if count == DRIVES_ACT else self.made(count)

    def made(self, count: int) -> bytes:
        """The first frames of those that the last exchange has made."""
        return bytes(self._bytes[: FRAME.size * count])

    def frames(self) -> bytes:
        """The TPDOs of this SYNC with the objects as they are, node by node, one frame behind the other."""
        return self.made(fill(self._numbers, self._sent, self._headers, self._turns, self._frames))


def _entries(pdo: int, mapping: Sequence[MappedObject], places: dict[str, int]) -> list[MappedPlace]:
    start, entries = 0, []
    for item in mapping:
        code = FORMATS[item.data_type]
        size = struct.calcsize(code)
        if item.attribute is not None:
            if item.attribute not in places:
                raise ValueError(f"{item.attribute} is computed")
            place = places[item.attribute]
            entries.append(MappedPlace(pdo, start, size, code.islower(), place, item.low, item.high))
        start += size
    return entries
