"""Following error supervision: window 6065h, time out 6066h."""

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects


class FollowingError:
    """Compares position demand and actual value once a tick."""

    def __init__(self, objects: DriveObjects, port: AxisPort) -> None:
        self._objects, self._port = objects, port

    def clear(self) -> None:
        """Reset the error: no position loop is closed."""
        self._port.record["outside_us"] = 0
        self._objects.following_error_actual_value = 0

    def check(self, dt_s: float) -> bool:
        """Update 60F4h; return whether the error has been too large for too long."""
        return self._port.check_following(dt_s)
