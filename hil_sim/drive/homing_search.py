"""The moves of homing methods: to limit switches, home switch, index pulse, or a mechanical stop.

A method is a generator: every `yield` is one tick of the drive. It sets `target_velocity`, to which the
velocity demand ramps, and returns the home position in motor counts.
"""

from collections.abc import Callable, Generator

from hil_sim.cyclic.drive_readings import HOME_SWITCH
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.homing_methods import BY_CURRENT, HOME, WITH_INDEX, HomeEdge, search_of
from hil_sim.drive.mode import Mode
from hil_sim.drive.travel_limits import TravelLimits

NEGATIVE_SWITCH, POSITIVE_SWITCH = 1, 2  # digital inputs 60FDh
TURNS_MAX = 1.1
"""Bounds the search for an index pulse, in turns: one has a pulse, the excess covers the ramp; chosen."""


class HomingFailed(Exception):  # noqa: N818  # an outcome of the search, not a program error
    """The search ended without a home position."""


class HomingSearch(Mode):
    """A position demand that moves at `target_velocity` (counts/s), and the searches that set it."""

    position_loop = generates_motion = searches_switches = True

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self.target_velocity = 0.0
        self._dt_s = 0.0

    def tick(self, dt_s: float, _cycle_fraction: float) -> None:
        """Ramp the velocity demand to the target and integrate the position demand."""
        self._dt_s = dt_s
        objects = self.objects
        before = self.velocity
        step = min(objects.homing_acceleration, objects.max_acceleration) * dt_s
        fastest = self.limits.motor_speed
        target = max(-fastest, min(fastest, self.target_velocity))
        self.velocity += max(-step, min(step, target - before))
        self.position += 0.5 * (before + self.velocity) * dt_s
        self.port.store_demand(self.position, self.velocity)
        self.port.command_position(self.position)

    def search(self, method: int) -> Generator[None, None, int]:
        """Carry out homing method `method`; return the home position in motor counts.

        Raises HomingFailed.
        """
        if method in {33, 34}:
            home = yield from self._find_index(-1 if method == 33 else 1)
        elif method in BY_CURRENT:
            home = yield from self._find_stop(*BY_CURRENT[method])
        elif search_of(method) in HOME:
            home = yield from self._find_home(HOME[search_of(method)], with_index=method in WITH_INDEX)
        else:
            home = yield from self._find_switch(-1 if method in {1, 17} else 1, with_index=method in {1, 2})
        yield from self._stop()
        return home

    def _find_home(self, edge: HomeEdge, *, with_index: bool) -> Generator[None, None, int]:
        """Cross the edge of the home switch slowly, in the direction of the method."""
        objects, across = self.objects, edge.direction

        def active() -> bool:
            return bool(objects.digital_inputs & HOME_SWITCH)

        arrival: int | None = None
        if not active():
            arrival = yield from self._seek_home(edge.start, active)
        if edge.leaves:
            if arrival != -across:  # not at this edge: leave the switch across it, and enter again
                yield from self._move(across, lambda: not active())
                yield from self._move(-across, active)
        else:
            yield from self._move(-across, lambda: not active())
        self.target_velocity = across * objects.speed_during_search_for_zero
        yield from self._until(lambda: active() != edge.leaves, self._switch_ahead(across))
        if with_index:
            return (yield from self._find_index(across))
        return self.port.motor_counts()

    def _seek_home(self, start: int, active: Callable[[], bool]) -> Generator[None, None, int]:
        """Move to the home switch; return the direction in which the axis arrived.

        The axis turns back at a limit switch.
        """
        direction = start
        ahead = self._switch_ahead(start)
        objects = self.objects
        self.target_velocity = direction * objects.speed_during_search_for_switch
        while not active():
            if objects.digital_inputs & ahead:
                yield from self._stop()
                direction = -start
                self.target_velocity = direction * objects.speed_during_search_for_switch
                yield from self._until(active, self._switch_ahead(direction))
            else:
                yield
        yield from self._stop()
        return direction

    def _move(self, direction: int, reached: Callable[[], bool]) -> Generator[None, None, None]:
        """Move at the speed of 6099h:01 until `reached()`, and stop."""
        self.target_velocity = direction * self.objects.speed_during_search_for_switch
        yield from self._until(reached, self._switch_ahead(direction))
        yield from self._stop()

    def _switch_ahead(self, direction: int) -> int:
        """Return the bit of 60FDh of the limit switch at the end of travel in this direction."""
        return NEGATIVE_SWITCH if direction * self.port.position_sign < 0 else POSITIVE_SWITCH

    def _find_stop(self, direction: int, with_index: bool) -> Generator[None, None, int]:
        """Push against a mechanical stop until the current has exceeded 2010h:01 for the time 2010h:02."""
        objects = self.objects
        self.target_velocity = direction * objects.speed_during_search_for_switch
        ahead, above_s = self._switch_ahead(direction), 0.0
        while above_s * 1e3 < objects.homing_current_threshold_time:
            yield
            if objects.digital_inputs & ahead:
                raise HomingFailed
            above = abs(objects.current_actual_value) >= objects.homing_current_threshold
            above_s = above_s + self._dt_s if above else 0.0
        self.position, self.velocity = float(self.port.position), 0.0  # ends the push
        self.target_velocity = 0.0
        if with_index:
            return (yield from self._find_index(-direction))
        return self.port.motor_counts()

    def _find_switch(self, direction: int, *, with_index: bool) -> Generator[None, None, int]:
        """Move to the limit switch, then slowly off it; home is where it opens, or the next index pulse."""
        searched, other = self._switch_ahead(direction), self._switch_ahead(-direction)
        objects = self.objects
        self.target_velocity = direction * objects.speed_during_search_for_switch
        yield from self._until(lambda: bool(objects.digital_inputs & searched), other)
        yield from self._stop()
        self.target_velocity = -direction * objects.speed_during_search_for_zero
        yield from self._until(lambda: not objects.digital_inputs & searched, other)
        if with_index:
            return (yield from self._find_index(-direction))
        return self.port.motor_counts()

    def _find_index(self, direction: int) -> Generator[None, None, int]:
        """Move slowly to the next index pulse of the encoder."""
        port = self.port
        start = before = port.motor_counts()
        ahead = self._switch_ahead(direction)
        self.target_velocity = direction * self.objects.speed_during_search_for_zero
        while True:
            yield
            now = port.motor_counts()
            found = port.encoder.index_between(before, now)
            if found is not None and (found - start) * direction * port.position_sign > 0:
                return found
            if (
                abs(now - start) > TURNS_MAX * port.encoder.counts_per_rev
                or self.objects.digital_inputs & ahead
            ):
                raise HomingFailed
            before = now

    def _until(self, reached: Callable[[], bool], wrong: int) -> Generator[None, None, None]:
        """Move until `reached()`. Raises HomingFailed if switch `wrong` closes; the axis may start on it."""
        was_open = False
        while not reached():
            is_open = not self.objects.digital_inputs & wrong
            if was_open and not is_open:
                raise HomingFailed
            was_open = was_open or is_open
            yield

    def _stop(self) -> Generator[None, None, None]:
        """Ramp the demand to zero and wait for standstill (606Fh)."""
        self.target_velocity = 0.0
        while self.velocity:
            yield
        while abs(self.objects.velocity_actual_value) > self.objects.velocity_threshold:
            yield
