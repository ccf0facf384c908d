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
        return max(self._objects.min_position_limit, self._blocked.get(-1, -math.inf))

    def high(self) -> float:
        """Largest position allowed (user counts)."""
        return min(self._objects.max_position_limit, self._blocked.get(1, math.inf))

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
        position = self._objects.position_actual_value
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
        """Clip a torque demand: none further into an active limit switch."""
        if wanted and self.blocks(1 if wanted * self._port.torque_side > 0 else -1):
            self.active = True
            return 0
        return wanted
