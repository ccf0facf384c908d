"""Limits of travel: software limits 607Dh and limit switches. They clip demands, which bit 11 shows."""

import math

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects


class TravelLimits:
    """Clips demands in user units. `active`: the last demand was clipped."""

    def __init__(self, objects: DriveObjects, port: AxisPort) -> None:
        self._objects = objects
        self._port = port
        self.active = False
        self.motor_speed = math.inf
        """Largest speed of the motor (counts/s), from 6080h."""
        self._blocked: dict[int, float] = {}  # direction: position at which the axis stopped at the switch

    @property
    def switched(self) -> bool:
        """Whether a limit switch blocks a direction."""
        return bool(self._blocked)

    def block(self, direction: int, position: float) -> None:
        """Allow no demand beyond `position` in `direction` (+1, -1): its limit switch is active."""
        self._blocked[direction] = position

    def keep_position_beyond(self, position: float) -> None:
        """Move the blocks to `position` where it lies beyond them: the axis is not pulled back."""
        for direction, blocked in self._blocked.items():
            if direction * (position - blocked) > 0.0:
                self._blocked[direction] = position

    def blocks(self, direction: int) -> bool:
        """Whether the limit switch of `direction` is active."""
        return direction in self._blocked

    def release(self, direction: int) -> None:
        """Lift the block of `direction`: its limit switch is open again."""
        self._blocked.pop(direction, None)

    def low(self) -> float:
        """Smallest position allowed (user counts)."""
        rotary = self._port.range.span
        software = self._while_wrapping()[0] if rotary else self._objects.min_position_limit
        return max(software, self._blocked.get(-1, -math.inf))

    def high(self) -> float:
        """Largest position allowed (user counts)."""
        rotary = self._port.range.span
        software = self._while_wrapping()[1] if rotary else self._objects.max_position_limit
        return min(software, self._blocked.get(1, math.inf))

    def _while_wrapping(self) -> tuple[float, float]:
        """Limits with a range 607Bh: none, unless a software limit inside it keeps it from wrapping."""
        low, high = self._objects.min_position_limit, self._objects.max_position_limit
        there = self._port.range
        if low <= there.low and high >= there.high:
            return -math.inf, math.inf
        return max(low, there.low), min(high, there.high)

    def shift(self, by: int) -> None:
        """Count all positions from another zero."""
        for direction in self._blocked:
            self._blocked[direction] += by

    def step(self, before: float, wanted: float, dt_s: float) -> float:
        """Clip the next of a sequence of position demands to the speed of the motor, 6080h."""
        way = self.motor_speed * dt_s
        if -way <= wanted - before <= way:
            return wanted
        self.active = True
        return before + math.copysign(way, wanted - before)

    def position(self, wanted: float) -> float:
        """Clip a position demand."""
        low, high = self.low(), self.high()
        if low <= wanted <= high:
            return wanted
        self.active = True
        return max(low, min(high, wanted))

    def speed(self, wanted: float) -> float:
        """Clip the speed (counts/s, >= 0) of a ramp: 607Fh, and 6080h at the motor."""
        return min(wanted, self._objects.max_profile_velocity, self.motor_speed)

    def velocity(self, wanted: float, deceleration: float, dt_s: float) -> float:
        """Clip a velocity demand (counts/s) so that braking at `deceleration` ends at the limit.

        The largest v with v dt + v^2 / 2a <= distance left.
        """
        if wanted == 0.0:
            return wanted
        if abs(wanted) > self.motor_speed:
            self.active = True
            wanted = math.copysign(self.motor_speed, wanted)
        position = self._port.position
        rising = wanted * self._port.velocity_side > 0.0
        distance = self.high() - position if rising else position - self.low()
        if distance <= 0.0:
            self.active = True
            return 0.0
        step = deceleration * dt_s
        largest = math.sqrt(step * step + 2.0 * deceleration * distance) - step
        if abs(wanted) <= largest:
            return wanted
        self.active = True
        return math.copysign(largest, wanted)

    def torque(self, wanted: int) -> int:
        """Clip a torque demand: none further into an active limit switch, none beyond the speed of 6080h."""
        if not wanted:
            return 0
        side = self._port.torque_side if wanted > 0 else -self._port.torque_side
        speed = self._objects.velocity_actual_value * self._port.velocity_side * side
        if self.blocks(side) or speed >= self.motor_speed:
            self.active = True
            return 0
        return wanted
