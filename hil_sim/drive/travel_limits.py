"""Limits of travel: software limits 607Dh and limit switches clip demands, as bit 11 of 6041h shows."""

import math

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects

BLOCKED = {-1: "blocked_low", 1: "blocked_high"}
"""Field of the port's record, by the direction of the switch: the position at which the axis stopped."""


class TravelLimits:
    """Clips the demands of one axis (counts, counts/s, per mille)."""

    def __init__(self, objects: DriveObjects, port: AxisPort) -> None:
        self._objects = objects
        self._port = port

    @property
    def active(self) -> bool:
        """Whether the last demand was clipped."""
        return bool(self._port.record["clipped"])

    @active.setter
    def active(self, clipped: bool) -> None:
        self._port.record["clipped"] = clipped

    @property
    def motor_speed(self) -> float:
        """Largest speed of the motor (counts/s), from 6080h."""
        return float(self._port.record["motor_speed"])

    @motor_speed.setter
    def motor_speed(self, counts_s: float) -> None:
        self._port.record["motor_speed"] = counts_s

    @property
    def switched(self) -> bool:
        """Whether a limit switch blocks a direction."""
        return self.blocks(-1) or self.blocks(1)

    def block(self, direction: int, position: float) -> None:
        """Allow no demand beyond `position` in `direction` (+1, -1): its limit switch is active."""
        self._port.record[BLOCKED[direction]] = position

    def keep_position_beyond(self, position: float) -> None:
        """Move the blocks to `position` where it lies beyond them, so that the axis is not pulled back."""
        for direction, field in BLOCKED.items():
            if self.blocks(direction) and direction * (position - self._port.record[field]) > 0.0:
                self._port.record[field] = position

    def blocks(self, direction: int) -> bool:
        """Whether the limit switch of `direction` is active."""
        return math.isfinite(self._port.record[BLOCKED[direction]])

    def release(self, direction: int) -> None:
        """Lift the block of `direction`: its limit switch is open again."""
        self._port.record[BLOCKED[direction]] = direction * math.inf

    def position(self, demand: float) -> float:
        """Clip a position demand."""
        return self._port.clip_position(demand)

    def shift(self, by: int) -> None:
        """Shift the blocked positions by `by` counts: the origin has moved."""
        for field in BLOCKED.values():
            self._port.record[field] += by

    def step(self, before: float, demand: float, dt_s: float) -> float:
        """Clip a position demand so that it follows `before` within the max motor speed 6080h."""
        return self._port.clip_step(before, demand, dt_s)

    def speed(self, demand: float) -> float:
        """Clip the speed (counts/s, >= 0) of a ramp: 607Fh, and 6080h at the motor."""
        return min(demand, self._objects.max_profile_velocity, self.motor_speed)

    def velocity(self, demand: float, deceleration: float, dt_s: float) -> float:
        """Clip a velocity demand (counts/s) so that braking at `deceleration` ends at the limit."""
        return self._port.clip_velocity(demand, deceleration, dt_s)

    def torque(self, demand: int) -> int:
        """Clip a torque demand (per mille): none into a closed limit switch, none beyond speed 6080h."""
        return self._port.clip_torque(demand)
