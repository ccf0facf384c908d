"""The base of all modes of operation, and the cyclic synchronous ones (CSP, CSV, CST).

A mode turns its process objects into commands for the axis port once per tick, and reports bits 10, 12
and 13 of the statusword.
"""

from enum import IntEnum

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.travel_limits import TravelLimits

TARGET_REACHED, BIT_12, BIT_13 = 1 << 10, 1 << 12, 1 << 13
FOLLOWS_COMMAND = BIT_12  # of the cyclic modes


class ModeCode(IntEnum):
    """Modes of operation 6060h that the drive supports."""

    NONE = 0
    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    HOMING = 6
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10


class Window:
    """True once a value has been inside its window for a time (ms)."""

    def __init__(self) -> None:
        self._inside_us = 0

    def update(self, inside: bool, dt_s: float, time_ms: int) -> bool:
        """Count one tick; return whether the value has been inside for `time_ms`."""
        if not inside:
            self._inside_us = 0
            return False
        self._inside_us += round(dt_s * 1e6)  # whole microseconds do not drift
        return self._inside_us >= 1000 * time_ms


class Interpolation:
    """Set points of a cyclic mode, each reached linearly within one communication cycle.

    It runs by time, not by SYNC: in real time an advance is a little longer or shorter than a cycle.
    """

    def __init__(self) -> None:
        self.present = 0.0
        self._start = 0.0
        self._target = 0.0
        self._progress = 1.0

    def hold(self, value: float) -> None:
        """Start at `value`, without a ramp."""
        self.present = self._start = self._target = value
        self._progress = 1.0

    def step(self, target: float, share: float) -> float:
        """Return the value a `share` of the cycle further on the way to `target`."""
        if target != self._target:
            self._start, self._target, self._progress = self.present, target, 0.0
        if self._progress < 1.0:
            self._progress += share
            whole = self._progress >= 1.0
            self.present = target if whole else self._start + (target - self._start) * self._progress
        return self.present


class Mode:
    """No mode of operation: an enabled axis holds standstill. The others derive from it."""

    position_loop = False
    """Whether the amplifier closes the position loop, so that the following error counts."""

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        self.objects = objects
        self.port = port
        self.limits = limits
        self.position = 0.0  # demand, user counts
        self.velocity = 0.0  # demand, counts/s; in a position loop in the direction of the position
        self.status = 0  # bits 10, 12, 13

    def enter(self) -> None:
        """Start the mode: operation has been enabled, or the mode was selected while it was."""
        self.resume(float(self.objects.position_actual_value))
        self.velocity = float(self.objects.velocity_actual_value)
        if self.position_loop:
            self.velocity *= self.port.velocity_side

    def leave(self) -> None:
        """End the mode: the axis no longer follows it."""
        self.status = 0

    def resume(self, position: float) -> None:
        """Continue from standstill at `position` after a stop."""
        self.position = position
        self.velocity = 0.0

    def command(self, controlword: int, previous: int) -> None:
        """React to the mode-specific bits of a new controlword."""

    def tick(self, _dt_s: float, _share: float) -> None:
        """Command the axis for the next `dt_s`, which is a `share` of the communication cycle."""
        self.port.command_velocity(0.0)

    def check(self, _dt_s: float) -> None:
        """Supervise the actual values after a tick."""


class CyclicTorque(Mode):
    """CST: target torque plus torque offset, within 6072h."""

    def enter(self) -> None:
        """Follow at once."""
        self.status = FOLLOWS_COMMAND

    def resume(self, position: float) -> None:
        """Follow at once."""
        super().resume(position)
        self.status = FOLLOWS_COMMAND

    def leave(self) -> None:
        """Clear the torque demand: from now on the amplifier's own loops make it."""
        super().leave()
        self.objects.torque_demand = 0

    def tick(self, _dt_s: float, _share: float) -> None:
        """Command the torque."""
        objects = self.objects
        torque = objects.target_torque + objects.torque_offset
        largest = objects.max_torque
        if not -largest <= torque <= largest:
            torque = largest if torque > 0 else -largest
        if self.limits.switched:
            torque = self.limits.torque(torque)
        objects.torque_demand = torque
        self.port.command_torque(torque)


class CyclicVelocity(Mode):
    """CSV: target velocity plus offset, in the amplifier's velocity loop."""

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self._set_point = Interpolation()

    def enter(self) -> None:
        """Follow from the present velocity."""
        self._set_point.hold(float(self.objects.velocity_actual_value))
        self.status = FOLLOWS_COMMAND

    def resume(self, position: float) -> None:
        """Follow from standstill."""
        super().resume(position)
        self._set_point.hold(0.0)
        self.status = FOLLOWS_COMMAND

    def tick(self, dt_s: float, share: float) -> None:
        """Command the velocity."""
        objects = self.objects
        target = float(objects.target_velocity + objects.velocity_offset)
        target = self.limits.velocity(target, objects.quick_stop_deceleration, dt_s)
        wanted = self._set_point.step(target, share)
        objects.velocity_demand_value = round(wanted)
        self.port.command_velocity(wanted, objects.torque_offset)


class CyclicPosition(Mode):
    """CSP: target position plus offset, in the amplifier's position loop."""

    position_loop = True

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self._set_point = Interpolation()

    def enter(self) -> None:
        """Follow from the present position."""
        self.resume(float(self.objects.position_actual_value))

    def resume(self, position: float) -> None:
        """Follow from standstill at `position`."""
        super().resume(position)
        self._set_point.hold(position)
        self.status = FOLLOWS_COMMAND

    def tick(self, dt_s: float, share: float) -> None:
        """Command the position."""
        objects = self.objects
        target = self.limits.position(objects.target_position + objects.position_offset)
        before = self._set_point.present
        wanted = self._set_point.step(target, share)
        self.port.show_demand(objects, wanted, (wanted - before) / dt_s)
        self.port.command_position(wanted, objects.velocity_offset, objects.torque_offset)
