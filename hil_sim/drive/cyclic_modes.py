"""The cyclic synchronous modes (CSP, CSV, CST): the controller sends a set point every cycle."""

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.mode import BIT_12, Mode
from hil_sim.drive.travel_limits import TravelLimits

FOLLOWS_COMMAND = BIT_12


class Interpolation:
    """Set points of a cyclic mode, each reached linearly within one communication cycle.

    It runs by time, not by SYNC: in real time an advance is a little longer or shorter than a cycle.
    """

    def __init__(self) -> None:
        self.hold(0.0)

    def hold(self, value: float) -> None:
        """Start at `value`, without a ramp."""
        self.present = self._start = self._target = value
        self._progress = 1.0

    def step(self, target: float, share: float) -> float:
        """Move on by a `share` of the cycle towards `target`; return the new set point."""
        if target != self._target:
            self._start, self._target, self._progress = self.present, target, 0.0
        if self._progress < 1.0:
            self._progress += share
            whole = self._progress >= 1.0
            self.present = target if whole else self._start + (target - self._start) * self._progress
        return self.present


class CyclicTorque(Mode):
    """CST: target torque plus torque offset, within 6072h."""

    def enter(self) -> None:
        """Follow at once."""
        self.status = FOLLOWS_COMMAND

    def resume(self, _position: float) -> None:
        """Follow at once."""
        self.status = FOLLOWS_COMMAND

    def leave(self) -> None:
        """Clear the torque demand: from now on the amplifier's own loops make it."""
        super().leave()
        self.objects.torque_demand = 0

    def tick(self, _dt_s: float, _share: float) -> None:
        """Command the torque."""
        objects = self.objects
        largest = objects.max_torque
        torque = max(-largest, min(largest, objects.target_torque + objects.torque_offset))
        if self.limits.switched or abs(objects.velocity_actual_value) >= self.limits.motor_speed:
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
        self._follow_from(float(self.objects.velocity_actual_value))

    def resume(self, _position: float) -> None:
        """Follow from standstill."""
        self._follow_from(0.0)

    def _follow_from(self, velocity: float) -> None:
        self._set_point.hold(velocity)
        self.status = FOLLOWS_COMMAND

    def tick(self, dt_s: float, share: float) -> None:
        """Command the velocity."""
        objects = self.objects
        target = float(objects.target_velocity + objects.velocity_offset)
        target = self.limits.velocity(target, objects.quick_stop_deceleration, dt_s)
        velocity = self._set_point.step(target, share)
        objects.velocity_demand_value = round(velocity)
        self.port.command_velocity(velocity, objects.torque_offset)


class CyclicPosition(Mode):
    """CSP: target position plus offset, in the amplifier's position loop."""

    position_loop = True

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self._set_point = Interpolation()

    def enter(self) -> None:
        """Follow from the present position."""
        self.resume(float(self.port.position))

    def resume(self, position: float) -> None:
        """Follow from standstill at `position`."""
        self._set_point.hold(position)
        self.status = FOLLOWS_COMMAND

    def tick(self, dt_s: float, share: float) -> None:
        """Command the position."""
        objects = self.objects
        before = self._set_point.present
        wanted = self.port.range.nearest(objects.target_position + objects.position_offset, before)
        position = self._set_point.step(self.limits.position(wanted), share)
        if (slower := self.limits.step(before, position, dt_s)) != position:
            position = slower
            self._set_point.hold(position)
        self.port.show_demand(objects, position, (position - before) / dt_s)
        self.port.command_position(position, objects.velocity_offset, objects.torque_offset)
