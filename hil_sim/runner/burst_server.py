"""The compiled call that serves a burst of frames, over the memory of one set of PDOs."""

import numpy as np

from can_frames.frame import FRAME_BYTES
from hil_sim.cyclic.burst_step import NO_SYNC, serve_burst
from hil_sim.drive.bench_drives import BenchDrives
from hil_sim.node.pdo_tables import PdoTables
from hil_sim.scale.bench_scales import BenchScales
from kernels.arrays import Index
from kernels.jit import ready_for

MOST_BYTES = 64 * FRAME_BYTES
"""Bounds the bytes served in a call (chosen: the burst of a port)."""


class BurstServer:
    """Serves frames by their `kinds` (2048,), see `burst_step`; the constructor compiles the call."""

    def __init__(self, drives: BenchDrives, scales: BenchScales, tables: PdoTables, kinds: Index) -> None:
        self.tables = tables
        self._burst = np.zeros(MOST_BYTES, np.uint8)
        self._bytes = self._burst.data
        received = kinds, tables.sizes, tables.data, tables.arrived
        # one by one: grouped in four named tuples, the arguments take twice as long to pass
        self._memory = (*received, *drives.memory, *scales.memory, *tables.memory)
        self._serve = ready_for(serve_burst, self._burst, 0, 0, NO_SYNC, 0, 1.0, 1.0, *self._memory)

    def serve(
        self,
        burst: bytes | bytearray,
        start: int,
        substeps: int,
        ticks: int,
        substep_us: float,
        cycle_us: float,
    ) -> tuple[int, int, int]:
        """Call `burst_step.serve_burst`; a returned frame number is the byte at which the frame begins."""
        part = burst[start : start + MOST_BYTES] if start or len(burst) > MOST_BYTES else burst
        size = len(part)
        self._bytes[:size] = part
        times = substeps, ticks, substep_us, cycle_us
        ending, number, count = self._serve(self._burst, 0, size // FRAME_BYTES, *times, *self._memory)
        return ending, start + number * FRAME_BYTES, count
