"""Touch probes 60B8h to 60BDh: positions at the edges of two inputs, or at the index pulse of the encoder.

The position of an edge within a tick is interpolated between the ends of the tick, like the position that the
hardware latch of a drive captures.
"""

from typing import NamedTuple

from hil_sim.config import AxisPlant
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects

ENABLE, CONTINUOUS, INDEX_PULSE, POSITIVE_EDGE, NEGATIVE_EDGE = 0x01, 0x02, 0x04, 0x10, 0x20
"""Bits of 60B8h for the first probe; those of the second are 8 places higher."""
FUNCTION_BITS = 0x3737
"""Bits of 60B8h that the drive supports, of both probes."""
ENABLED, STORED_POSITIVE, STORED_NEGATIVE = 0x01, 0x02, 0x04
"""Bits of 60B9h for the first probe; those of the second are 8 places higher."""
ANY_ENABLED = ENABLE | ENABLE << 8


class Edge(NamedTuple):
    """An edge within this tick: its position in motor counts, and whether the input became active."""

    motor_counts: int
    rising: bool


class TouchProbes:
    """Both probes of an axis; `watching`: a probe is enabled, so that every tick must call `capture`."""

    def __init__(self, config: AxisPlant, objects: DriveObjects, port: AxisPort) -> None:
        self._objects = objects
        self._port = port
        probes = config.touch_probes
        self._at_m = [None if mm is None else mm * 1e-3 for mm in (probes.first_mm, probes.second_mm)]
        self.reset()

    def reset(self) -> None:
        """Disable both probes, as after power-up."""
        self.function = 0
        self.watching = False
        self._objects.touch_probe_status = 0

    def set_function(self) -> None:
        """Apply a new touch probe function 60B8h; enabling a probe clears its stored positions."""
        objects, before = self._objects, self.function
        self.function = objects.touch_probe_function
        for probe in (0, 1):
            enabled = self.function >> 8 * probe & ENABLE
            if not enabled:
                objects.touch_probe_status &= ~(0xFF << 8 * probe)
            elif not before >> 8 * probe & ENABLE:
                status = objects.touch_probe_status & ~(0xFF << 8 * probe)
                objects.touch_probe_status = status | ENABLED << 8 * probe
        if self.function & ANY_ENABLED and not self.watching:
            self._counts, self._table_m = self._port.motor_counts(), self._port.table_position_m()
        self.watching = bool(self.function & ANY_ENABLED)

    def capture(self) -> None:
        """Store the positions of the edges since the last tick."""
        before, before_m = self._counts, self._table_m
        self._counts, self._table_m = self._port.motor_counts(), self._port.table_position_m()
        for probe in (0, 1):
            function = self.function >> 8 * probe
            if function & ENABLE:
                edge = self._edge(probe, function, before, before_m)
                if edge is not None:
                    self._store(probe, function, edge)

    def _edge(self, probe: int, function: int, before: int, before_m: float) -> Edge | None:
        if function & INDEX_PULSE:
            pulse = self._port.encoder.index_between(before, self._counts)
            return None if pulse is None else Edge(pulse, rising=True)
        at_m = self._at_m[probe]
        if at_m is None or (before_m >= at_m) == (self._table_m >= at_m):
            return None
        fraction = (at_m - before_m) / (self._table_m - before_m)
        return Edge(round(before + fraction * (self._counts - before)), rising=self._table_m >= at_m)

    def _store(self, probe: int, function: int, edge: Edge) -> None:
        stored = (STORED_POSITIVE if edge.rising else STORED_NEGATIVE) << 8 * probe
        objects = self._objects
        if not function & (POSITIVE_EDGE if edge.rising else NEGATIVE_EDGE):
            return
        if objects.touch_probe_status & stored and not function & CONTINUOUS:
            return
        objects.touch_probe_status |= stored
        position = self._port.user_position(edge.motor_counts)
        match probe, edge.rising:
            case 0, True:
                objects.touch_probe_1_positive_edge = position
            case 0, False:
                objects.touch_probe_1_negative_edge = position
            case 1, True:
                objects.touch_probe_2_positive_edge = position
            case _:
                objects.touch_probe_2_negative_edge = position
