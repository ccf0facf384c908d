"""Interpolated position mode: linear interpolation between buffered set points, one per period 60C2h.

A write of 60C1h appends a set point to the buffer (60C4h: a FIFO); if a PDO maps it, every frame appends one.
While the buffer is empty the axis holds the last set point.
"""

from collections import deque

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.mode import BIT_12, Mode
from hil_sim.drive.travel_limits import TravelLimits

ENABLE = 1 << 4
"""Bit of the controlword."""
ACTIVE = BIT_12
PROGRESS_TOLERANCE = 1e-9
"""Bounds the rounding of the sum of ticks in a period, in periods; chosen."""


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

    def tick(self, dt_s: float, _cycle_fraction: float) -> None:
        """Advance the demand along the line between two set points."""
        objects = self.objects
        before = self.position
        if self.status & ACTIVE:
            self._progress += dt_s / (
                objects.interpolation_time_period_value * 10.0**objects.interpolation_time_index
            )
            while self._progress >= 1.0 - PROGRESS_TOLERANCE:
                self._from, progress = self._to, self._progress
                if not self.set_points:
                    self._progress = 1.0
                    break
                set_point = self.port.range.nearest_equivalent(self.set_points.popleft(), self._from)
                self._to = self.limits.position(set_point)
                self._progress = progress - 1.0 if progress > 1.0 else 0.0
            demand = self._from + (self._to - self._from) * min(1.0, self._progress)
            self.position = self.limits.step(before, demand, dt_s)
        self.velocity = (self.position - before) / dt_s
        self.port.store_demand(self.position, self.velocity)
        self.port.command_position(self.position, objects.torque_offset)
