"""Homing mode: its start, its end, and the home position that a search finds.

The home position is found in motor counts (`homing_search`). At the end the user zero is at a distance of
607Ch on the positive side of it, so that 6064h reads -607Ch there.
"""

from collections.abc import Generator

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.homing_methods import AT_PRESENT_POSITION, METHODS, NO_HOMING
from hil_sim.drive.homing_search import HomingFailed, HomingSearch
from hil_sim.drive.mode import BIT_12, BIT_13, TARGET_REACHED
from hil_sim.drive.travel_limits import TravelLimits

START = 1 << 4
ATTAINED, ERROR = BIT_12, BIT_13


class Homing(HomingSearch):
    """HM: started by a rising edge of bit 4, ended by its fall; result in bits 10, 12, 13."""

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        super().__init__(objects, port, limits)
        self.homed = False
        self._search: Generator[None, None, int] | None = None

    def enter(self) -> None:
        """Hold the present position and report whether the axis is homed."""
        super().enter()
        self._search = None
        self.target_velocity = 0.0
        self._show_idle()

    def resume(self, position: float) -> None:
        """Report the search as interrupted: a halt has ended it."""
        super().resume(position)
        self._interrupt()
        if not self.status:  # this mode was selected during the halt
            self._show_idle()

    def _show_idle(self) -> None:
        self.status = TARGET_REACHED | (ATTAINED if self.homed else 0)

    def leave(self) -> None:
        """Abort the search."""
        super().leave()
        self._search = None

    def slow_down_deceleration(self) -> int:
        """The homing acceleration, 609Ah."""
        return self.objects.homing_acceleration

    def command(self, controlword: int, previous: int) -> None:
        """Start the search at a rising edge of bit 4, interrupt it at a falling one."""
        if controlword & START and not previous & START:
            self._begin()
        elif not controlword & START and self._search is not None:
            self._interrupt()

    def check(self, _dt_s: float) -> None:
        """Continue the search by one tick, with the inputs and the position of this tick."""
        if self._search is not None:
            self._advance(self._search)

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
        self._search = self.search(method)
        self._advance(self._search)

    def _advance(self, search: Generator[None, None, int]) -> None:
        try:
            next(search)
        except StopIteration as end:
            self._search = None
            self._set_home(end.value)
        except HomingFailed:
            self._search = None
            self.target_velocity = 0.0
            self.status = ERROR

    def _interrupt(self) -> None:
        self.target_velocity = 0.0
        if self._search is not None:
            self._search = None
            self.status = TARGET_REACHED

    def _set_home(self, home_counts: int) -> None:
        """Shift the user zero so that the home position (motor counts) reads -607Ch."""
        port = self.port
        origin = -self.objects.home_offset - port.position_sign * home_counts
        self.position += origin - port.origin
        port.origin = origin
        self.homed = True
        self.status = ATTAINED | TARGET_REACHED
        port.read()
        port.store_demand(self.position, self.velocity)
