"""Following error supervision: window 6065h, time out 6066h."""

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects

SWITCHED_OFF = 0xFFFF_FFFF


class FollowingError:
    """Compares position demand and actual value once a tick."""

    def __init__(self, objects: DriveObjects, port: AxisPort) -> None:
        self._objects = objects
        self._port = port
        self._outside_us = 0

    def clear(self) -> None:
        """Reset the error: no position loop is closed."""
        self._outside_us = 0
        self._objects.following_error_actual_value = 0

    def check(self, dt_s: float) -> bool:
        """Update 60F4h; return whether the error has been too large for too long."""
        objects = self._objects
        error = objects.position_demand_internal_value - self._port.position
        objects.following_error_actual_value = error
        window = objects.following_error_window
        if window == SWITCHED_OFF or abs(error) <= window:
            self._outside_us = 0
            return False
        self._outside_us += round(dt_s * 1e6)
        return self._outside_us > 1000 * objects.following_error_time_out
