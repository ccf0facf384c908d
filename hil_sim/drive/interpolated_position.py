"""Interpolated position mode: linear interpolation between buffered set points, one per period 60C2h.

A write of 60C1h appends a set point to the buffer (60C4h: a FIFO); mapped in a PDO, every frame appends one.
While the buffer is empty the axis holds the last set point.
"""

from collections import deque

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.mode import BIT_12, Mode
from hil_sim.drive.travel_limits import TravelLimits

ENABLE = 1 << 4
ACTIVE = BIT_12


class InterpolatedPosition(Mode):
    """IP: bit 4 of the controlword starts and stops it, bit 12 of the statusword shows it."""

    position_loop = generates_motion = True

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self.set_points: deque[int] = deque()
        self._from = self._to = 0.0
        self._progress = 1.0

    def resume(self, position: float) -> None:
        """Hold standstill at `position` until set points arrive."""
        super().resume(position)
        self._from = self._to = position
        self._progress = 1.0

    def leave(self) -> None:
        """Clear the buffer."""
        super().leave()
        self.set_points.clear()

    def command(self, controlword: int, _previous: int) -> None:
        """Start or stop the interpolation."""
        self.status = ACTIVE if controlword & ENABLE else 0

    def push(self, set_point: int) -> bool:
        """Append a set point (counts) to the buffer; return whether there was room."""
        room = len(self.set_points) < self.objects.actual_buffer_size
        if room:
            self.set_points.append(set_point)
        return room

    def tick(self, dt_s: float, _share: float) -> None:
        """Advance the demand along the line between two set points."""
        objects = self.objects
        before = self.position
        if self.status & ACTIVE:
            self._progress += dt_s / (
                objects.interpolation_time_period_value * 10.0**objects.interpolation_time_index
            )
            while self._progress >= 1.0 - 1e-9:
                self._from, arrived = self._to, self._progress
                if not self.set_points:
                    self._progress = 1.0
                    break
                wanted = self.port.range.nearest_equivalent(self.set_points.popleft(), self._from)
                self._to = self.limits.position(wanted)
                self._progress = arrived - 1.0 if arrived > 1.0 else 0.0
            share = min(1.0, self._progress)
            wanted = self._from + (self._to - self._from) * share
            self.position = self.limits.step(before, wanted, dt_s)
        self.velocity = (self.position - before) / dt_s
        self.port.store_demand(self.position, self.velocity)
        self.port.command_position(self.position, objects.torque_offset)
