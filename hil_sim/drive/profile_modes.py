"""Profile position and profile velocity mode: the drive generates the motion."""

import math
from typing import NamedTuple

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.jerk_filter import JerkFilter
from hil_sim.drive.mode import BIT_12, BIT_13, TARGET_REACHED, Mode
from hil_sim.drive.position_range import DIRECTION
from hil_sim.drive.profile import Profile, plan
from hil_sim.drive.travel_limits import TravelLimits

NEW_SET_POINT, CHANGE_IMMEDIATELY, RELATIVE = 1 << 4, 1 << 5, 1 << 6
JERK_LIMITED = 3
"""Motion profile type 6086h; 0 is the linear ramp."""
RELATIVE_OPTION, TO_TARGET, TO_DEMAND = 0x3, 0, 1
"""Bits 0 and 1 of 60F2h: base of a relative set-point; 2 is the actual position."""
MAX_SLIPPAGE_ERROR = BIT_13
SET_POINT_ACKNOWLEDGE = BIT_12
SPEED_IS_ZERO = BIT_12


class Window:
    """Measures for how long a value has been inside its window."""

    def __init__(self) -> None:
        self._inside_us = 0

    def update(self, inside: bool, dt_s: float, time_ms: int) -> bool:
        """Add one tick; return whether the value has been inside for `time_ms`."""
        self._inside_us = self._inside_us + round(dt_s * 1e6) if inside else 0  # integers do not drift
        return inside and self._inside_us >= 1000 * time_ms


class SetPoint(NamedTuple):
    """A target (counts), with the profile parameters at the time of its command."""

    target: float
    speed: float
    acceleration: float
    deceleration: float
    end_velocity: float = 0.0
    direction: int | None = None
    """Rotary axis direction option of 60F2h for an absolute target; None: the target does not wrap."""


class ProfilePosition(Mode):
    """PP: one active set-point, one buffered, by the handshake of bits 4 and 12."""

    position_loop = generates_motion = True

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self._profile: Profile | None = None
        self._time_s = 0.0
        self._current: SetPoint | None = None
        self._buffered: SetPoint | None = None
        self._requested = False  # bit 4 of the last controlword
        self._window = Window()
        self._reached = True
        self._filter: JerkFilter | None = None
        self._unfiltered: tuple[float, float] | None = None  # position and velocity at the filter's input
        self._beyond = 0.0  # distance from the target to standstill of a set-point with an end velocity

    def enter(self) -> None:
        """Hold the present position; brake an axis in motion."""
        super().enter()
        self._current = self._buffered = None
        self._requested = False
        self._filter = self._unfiltered = None
        self._start(self._set_point(self._stopping_position()))
        self._reached = True
        self.status = TARGET_REACHED

    def resume(self, position: float) -> None:
        """Continue to the set-point that a halt interrupted, if there is one."""
        super().resume(position)
        self._profile = self._filter = self._unfiltered = None
        if self._current is not None:
            self._start(self._current)

    def leave(self) -> None:
        """Discard the set-points."""
        super().leave()
        self._current = self._buffered = self._profile = None

    def command(self, controlword: int, previous: int) -> None:
        """Accept a new set-point by the handshake of bits 4 and 12."""
        requested = bool(controlword & NEW_SET_POINT)
        if requested and not previous & NEW_SET_POINT and self._buffered is None:
            objects = self.objects
            relative = bool(controlword & RELATIVE)
            base = self._base() if relative else 0.0
            point = self._set_point(base + objects.target_position, objects.end_velocity)
            if not relative:
                point = point._replace(direction=objects.positioning_option_code & DIRECTION)
            if controlword & CHANGE_IMMEDIATELY or self._reached:
                self._start(point)
            else:
                self._buffered = point
        self._requested = requested
        self._show()

    def tick(self, dt_s: float, _cycle_fraction: float) -> None:
        """Follow the profile."""
        self._time_s += dt_s
        objects = self.objects
        if self._current is not None and self._current.speed <= 0.0 < objects.profile_velocity:
            speed = self.limits.speed(objects.profile_velocity)
            self._start(self._current._replace(speed=speed))  # commanded at profile velocity 0
        if self._profile is not None:
            self._follow(self._profile, dt_s)
        self.port.store_demand(self.position, self.velocity)
        self.port.command_position(self.position, objects.torque_offset)

    def check(self, dt_s: float) -> None:
        """Set target reached once the demand stands still and the position is inside 6067h for 6068h."""
        objects = self.objects
        profile = self._profile
        ended = profile is None or self._time_s >= profile.duration_s
        if self._current is not None and self._current.speed <= 0.0:
            ended = ended and self.position == self._current.target
        if self._filter is not None:
            ended = ended and self._filter.settled
        error = abs(self.position - self.port.position)
        inside = ended and error <= objects.position_window
        if self._window.update(inside, dt_s, objects.position_window_time) or self._passes_target():
            self._reached = True
            if self._buffered is not None:
                point, self._buffered = self._buffered, None
                self._start(point)
        self._show()

    def _start(self, point: SetPoint) -> None:
        target = point.target
        if point.direction is not None:
            target = self.port.range.towards(int(target), self._stopping_position(), point.direction)
        target = self.limits.position(target)
        self._current = point._replace(target=target, direction=None)
        position, velocity = self._unfiltered or (self.position, self.velocity)
        end_velocity = min(point.end_velocity, point.speed)
        self._beyond = math.copysign(end_velocity**2 / (2.0 * point.deceleration), target - position)
        standstill = self.limits.position(target + self._beyond) if self._beyond else target
        self._profile = plan(
            position,
            velocity,
            target=standstill,
            speed=point.speed,
            acceleration=point.acceleration,
            deceleration=point.deceleration,
        )
        self._time_s = 0.0
        self._reached = False
        self._window.update(False, 0.0, 0)

    def _set_point(self, target: float, end_velocity: float = 0.0) -> SetPoint:
        objects = self.objects
        return SetPoint(
            target,
            self.limits.speed(objects.profile_velocity),
            min(objects.profile_acceleration, objects.max_acceleration),
            min(objects.profile_deceleration, objects.max_deceleration),
            end_velocity,
        )

    def _base(self) -> float:
        """Return the base of a relative set-point by 60F2h (counts)."""
        option = self.objects.positioning_option_code & RELATIVE_OPTION
        if option == TO_TARGET:
            return self.position if self._current is None else self._current.target
        return self.position if option == TO_DEMAND else float(self.port.position)

    def _passes_target(self) -> bool:
        """Return whether the demand has passed a set-point with an end velocity (6082h)."""
        current = self._current
        return (
            bool(self._beyond)
            and current is not None
            and (self.position - current.target) / self._beyond >= 0.0
        )

    def _follow(self, profile: Profile, dt_s: float) -> None:
        """Move the demand along the profile, through the jerk filter if 6086h selects it."""
        position, velocity = profile.at(self._time_s)
        self._unfiltered = None
        if self.objects.motion_profile_type != JERK_LIMITED and self._filter is None:
            self.position, self.velocity = position, velocity
            return
        current = self._current
        if self._filter is None:
            if self.velocity or current is None:  # the filter can only start at standstill
                self.position, self.velocity = position, velocity
                return
            steepest = max(current.acceleration, current.deceleration)
            self._filter = JerkFilter(self.position, steepest, self.objects.profile_jerk, dt_s)
        before = self.position
        self._unfiltered = (position, velocity)
        self.position = self._filter.step(position)
        self.velocity = (self.position - before) / dt_s
        if self._filter.settled:
            self._filter = self._unfiltered = None

    def _stopping_position(self) -> float:
        deceleration = min(self.objects.profile_deceleration, self.objects.max_deceleration)
        return self.position + self.velocity * abs(self.velocity) / (2.0 * deceleration)

    def _show(self) -> None:
        acknowledged = self._requested and self._current is not None
        self.status = TARGET_REACHED if self._reached else 0
        if acknowledged or self._buffered is not None:
            self.status |= SET_POINT_ACKNOWLEDGE


class ProfileVelocity(Mode):
    """PV: the velocity demand ramps to 60FFh at 6083h and 6084h."""

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self._at_target = Window()
        self._at_standstill = Window()

    def tick(self, dt_s: float, _cycle_fraction: float) -> None:
        """Move the demand one step along its ramp."""
        objects = self.objects
        highest = self.limits.speed(objects.max_profile_velocity)
        target = float(max(-highest, min(highest, objects.target_velocity)))
        braking = min(objects.profile_deceleration, objects.max_deceleration)
        target = self.limits.velocity(target, braking, dt_s)
        speeding_up = target * self.velocity >= 0.0 and abs(target) > abs(self.velocity)
        ramp = min(objects.profile_acceleration, objects.max_acceleration) if speeding_up else braking
        step = ramp * dt_s
        self.velocity += max(-step, min(step, target - self.velocity))
        objects.velocity_demand_value = round(self.velocity)
        self.port.command_velocity(self.velocity, objects.torque_offset)

    def check(self, dt_s: float) -> None:
        """Set bit 10, velocity reached (606Dh, 606Eh), and bit 12, standstill (606Fh, 6070h)."""
        objects = self.objects
        actual = objects.velocity_actual_value
        near_target = abs(objects.target_velocity - actual) <= objects.velocity_window
        slow = abs(actual) <= objects.velocity_threshold
        reached = self._at_target.update(near_target, dt_s, objects.velocity_window_time)
        standstill = self._at_standstill.update(slow, dt_s, objects.velocity_threshold_time)
        self.status = TARGET_REACHED * reached | SPEED_IS_ZERO * standstill
        if abs(objects.velocity_demand_value - actual) > objects.max_slippage:
            self.status |= MAX_SLIPPAGE_ERROR
