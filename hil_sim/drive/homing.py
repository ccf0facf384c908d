"""Homing mode: the methods of CiA 402, and four by current, each a sequence of moves (`homing_methods`).

A method is a generator: every `yield` is one tick of the drive. The home position is taken in motor counts;
at the end the user zero lies 607Ch to the positive side of it, so 6064h there reads -607Ch.
"""

from collections.abc import Callable, Generator

from hil_sim.cyclic.drive_step import HOME_SWITCH
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.homing_methods import (
    AT_PRESENT_POSITION,
    BY_CURRENT,
    HOME,
    METHODS,
    NO_HOMING,
    WITH_INDEX,
    HomeEdge,
    search_of,
)
from hil_sim.drive.mode import BIT_12, BIT_13, TARGET_REACHED, Mode
from hil_sim.drive.travel_limits import TravelLimits

START = 1 << 4
ATTAINED, ERROR = BIT_12, BIT_13
NEGATIVE_SWITCH, POSITIVE_SWITCH = 1, 2  # digital inputs 60FDh
SEARCHED_TURNS = 1.1
"""Bounds the search for an index pulse, of which a turn has one; the excess covers the ramp (chosen)."""


class HomingFailed(Exception):  # noqa: N818  # an outcome of the search, not a program error
    """The search ended without a home position."""


class Homing(Mode):
    """HM: started by a rising edge of bit 4, ended by its fall; result in bits 10, 12, 13."""

    position_loop = generates_motion = searches_switches = True

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self.homed = False
        self._moves: Generator[None, None, int] | None = None
        self._target_velocity = 0.0  # velocity the ramp runs to, counts/s
        self._dt_s = 0.0

    def enter(self) -> None:
        """Hold the present position and show whether it is a homed one."""
        super().enter()
        self._moves = None
        self._target_velocity = 0.0
        self._show_idle()

    def resume(self, position: float) -> None:
        """Show the search as interrupted: a halt has ended it."""
        super().resume(position)
        self._interrupt()
        if not self.status:  # this mode was chosen during the halt
            self._show_idle()

    def _show_idle(self) -> None:
        self.status = TARGET_REACHED | (ATTAINED if self.homed else 0)

    def leave(self) -> None:
        """Abandon the search."""
        super().leave()
        self._moves = None

    def slow_down_deceleration(self) -> int:
        """The homing acceleration, 609Ah."""
        return self.objects.homing_acceleration

    def command(self, controlword: int, previous: int) -> None:
        """Start the search at a rising edge of bit 4, interrupt it at a falling one."""
        if controlword & START and not previous & START:
            self._begin()
        elif not controlword & START and self._moves is not None:
            self._interrupt()

    def tick(self, dt_s: float, _share: float) -> None:
        """Ramp the velocity demand to the target and integrate the position demand."""
        self._dt_s = dt_s
        objects = self.objects
        before = self.velocity
        step = min(objects.homing_acceleration, objects.max_acceleration) * dt_s
        fastest = self.limits.motor_speed
        target = max(-fastest, min(fastest, self._target_velocity))
        self.velocity += max(-step, min(step, target - before))
        self.position += 0.5 * (before + self.velocity) * dt_s
        self.port.show_demand(self.position, self.velocity)
        self.port.command_position(self.position)

    def check(self, _dt_s: float) -> None:
        """Run the search one tick further, with the inputs and the position of this tick."""
        if self._moves is not None:
            self._advance(self._moves)

    def _begin(self) -> None:
        method = self.objects.homing_method
        if method == NO_HOMING:
            self._show_idle()
            return
        if method not in METHODS:
            self.status = ERROR | TARGET_REACHED
            return
        if method in AT_PRESENT_POSITION:
            self._set_home(self.port.motor_counts())
            return
        self.homed = False
        self.status = 0
        self._moves = self._search(method)
        self._advance(self._moves)

    def _advance(self, moves: Generator[None, None, int]) -> None:
        try:
            next(moves)
        except StopIteration as end:
            self._moves = None
            self._set_home(end.value)
        except HomingFailed:
            self._moves = None
            self._target_velocity = 0.0
            self.status = ERROR

    def _interrupt(self) -> None:
        self._target_velocity = 0.0
        if self._moves is not None:
            self._moves = None
            self.status = TARGET_REACHED

    def _set_home(self, home_counts: int) -> None:
        """Shift the user zero so that `home_counts` (motor counts) is at -607Ch."""
        port = self.port
        origin = -self.objects.home_offset - port.position_sign * home_counts
        self.position += origin - port.origin
        port.origin = origin
        self.homed = True
        self.status = ATTAINED | TARGET_REACHED
        port.read()
        port.show_demand(self.position, self.velocity)

    # --- methods ----------------------------------------------------------------------------------

    def _search(self, method: int) -> Generator[None, None, int]:
        """Make the moves of a method; return the home position in motor counts."""
        if method in {33, 34}:
            home = yield from self._find_index(-1 if method == 33 else 1)
        elif method in BY_CURRENT:
            home = yield from self._find_block(*BY_CURRENT[method])
        elif search_of(method) in HOME:
            home = yield from self._find_home(HOME[search_of(method)], with_index=method in WITH_INDEX)
        else:
            home = yield from self._find_switch(-1 if method in {1, 17} else 1, with_index=method in {1, 2})
        yield from self._stop()
        return home

    def _find_home(self, edge: HomeEdge, *, with_index: bool) -> Generator[None, None, int]:
        """Cross the wanted edge of the home switch slowly, in the wanted direction."""
        objects, across = self.objects, edge.direction

        def active() -> bool:
            return bool(objects.digital_inputs & HOME_SWITCH)

        came: int | None = None
        if not active():
            came = yield from self._seek_home(edge.start, active)
        if edge.leaves:
            if came != -across:  # it is inside, at the other edge or anywhere: out, and in again by this one
                yield from self._move(across, lambda: not active())
                yield from self._move(-across, active)
        else:
            yield from self._move(-across, lambda: not active())
        self._target_velocity = across * objects.speed_during_search_for_zero
        yield from self._until(lambda: active() != edge.leaves, self._switch_ahead(across))
        if with_index:
            return (yield from self._find_index(across))
        return self.port.motor_counts()

    def _seek_home(self, start: int, active: Callable[[], bool]) -> Generator[None, None, int]:
        """Move to the home switch, back again from a limit switch; return the direction it was found in."""
        direction = start
        ahead = self._switch_ahead(start)
        objects = self.objects
        self._target_velocity = direction * objects.speed_during_search_for_switch
        while not active():
            if objects.digital_inputs & ahead:
                yield from self._stop()
                direction = -start
                self._target_velocity = direction * objects.speed_during_search_for_switch
                yield from self._until(active, self._switch_ahead(direction))
            else:
                yield
        yield from self._stop()
        return direction

    def _move(self, direction: int, reached: Callable[[], bool]) -> Generator[None, None, None]:
        """Move quickly until `reached()`, and stop there."""
        self._target_velocity = direction * self.objects.speed_during_search_for_switch
        yield from self._until(reached, self._switch_ahead(direction))
        yield from self._stop()

    def _switch_ahead(self, direction: int) -> int:
        return NEGATIVE_SWITCH if direction * self.port.position_sign < 0 else POSITIVE_SWITCH

    def _find_block(self, direction: int, with_index: bool) -> Generator[None, None, int]:
        """Push against a block until the current has been above 2010h:01 for 2010h:02."""
        objects = self.objects
        self._target_velocity = direction * objects.speed_during_search_for_switch
        ahead, above_s = self._switch_ahead(direction), 0.0
        while above_s * 1e3 < objects.homing_current_threshold_time:
            yield
            if objects.digital_inputs & ahead:
                raise HomingFailed
            above = abs(objects.current_actual_value) >= objects.homing_current_threshold
            above_s = above_s + self._dt_s if above else 0.0
        self.position, self.velocity = float(self.port.position), 0.0  # it pushes no longer
        self._target_velocity = 0.0
        if with_index:
            return (yield from self._find_index(-direction))
        return self.port.motor_counts()

    def _find_switch(self, direction: int, *, with_index: bool) -> Generator[None, None, int]:
        wanted = NEGATIVE_SWITCH if direction * self.port.position_sign < 0 else POSITIVE_SWITCH
        other = NEGATIVE_SWITCH + POSITIVE_SWITCH - wanted
        objects = self.objects
        self._target_velocity = direction * objects.speed_during_search_for_switch
        yield from self._until(lambda: bool(objects.digital_inputs & wanted), other)
        yield from self._stop()
        self._target_velocity = -direction * objects.speed_during_search_for_zero
        yield from self._until(lambda: not objects.digital_inputs & wanted, other)
        if with_index:
            return (yield from self._find_index(-direction))
        return self.port.motor_counts()

    def _find_index(self, direction: int) -> Generator[None, None, int]:
        port = self.port
        start = before = port.motor_counts()
        ahead = NEGATIVE_SWITCH if direction * port.position_sign < 0 else POSITIVE_SWITCH
        self._target_velocity = direction * self.objects.speed_during_search_for_zero
        while True:
            yield
            now = port.motor_counts()
            found = port.index_between(before, now)
            if found is not None and (found - start) * direction * port.position_sign > 0:
                return found
            if abs(now - start) > SEARCHED_TURNS * port.counts_per_rev or self.objects.digital_inputs & ahead:
                raise HomingFailed
            before = now

    def _until(self, reached: Callable[[], bool], wrong: int) -> Generator[None, None, None]:
        """Move until `reached()`. Fails when the switch `wrong` closes; the axis may start on it."""
        was_open = False
        while not reached():
            is_open = not self.objects.digital_inputs & wrong
            if was_open and not is_open:
                raise HomingFailed
            was_open = was_open or is_open
            yield

    def _stop(self) -> Generator[None, None, None]:
        self._target_velocity = 0.0
        while self.velocity:
            yield
        while abs(self.objects.velocity_actual_value) > self.objects.velocity_threshold:
            yield
