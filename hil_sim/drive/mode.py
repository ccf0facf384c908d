"""The base of all modes of operation (6060h).

Once a tick a mode computes commands for the axis port from its process objects, and bits 10, 12 and 13 of the
statusword.
"""

from enum import IntEnum

from hil_sim.cyclic.drive_record import NO_CYCLIC_MODE
from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.travel_limits import TravelLimits

TARGET_REACHED, BIT_12, BIT_13 = 1 << 10, 1 << 12, 1 << 13
"""Bits of the statusword; the meaning of 12 and 13 depends on the mode."""


class ModeCode(IntEnum):
    """Modes of operation 6060h that the drive supports."""

    NONE = 0
    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10


class Mode:
    """No mode of operation: an enabled axis stays at standstill. The other modes derive from it."""

    cyclic_code: int = NO_CYCLIC_MODE
    """Code of a cyclic mode, which the compiled tick serves; NO_CYCLIC_MODE for other modes."""
    position_loop = False
    """Whether the amplifier closes the position loop, so that the following error counts."""
    generates_motion = False
    """Whether the drive computes the position demand, so that a stop continues from it (PP, IP, HM)."""
    searches_switches = False
    """Whether the mode searches limit switches, which then do not stop the axis (HM)."""

    def __init__(self, objects: DriveObjects, port: AxisPort, limits: TravelLimits) -> None:
        self.objects = objects
        self.port = port
        self.limits = limits
        self.position = 0.0  # demand, user counts
        self.velocity = 0.0  # demand, counts/s; in a position loop with the sign of the position change
        self.status = 0  # bits 10, 12, 13

    def enter(self) -> None:
        """Start the mode: operation has been enabled, or the mode was selected in operation enabled."""
        self.resume(float(self.port.position))
        self.velocity = float(self.objects.velocity_actual_value)
        if self.position_loop:
            self.velocity *= self.port.position_change_sign

    def leave(self) -> None:
        """End the mode: the axis no longer follows it."""
        self.status = 0

    def resume(self, position: float) -> None:
        """Continue from standstill at `position` after a stop."""
        self.position = position
        self.velocity = 0.0

    def slow_down_deceleration(self) -> int:
        """Deceleration of the slow down ramp (counts/s^2)."""
        return self.objects.profile_deceleration

    def command(self, controlword: int, previous: int) -> None:
        """React to the operation mode specific bits of a new controlword."""

    def tick(self, _dt_s: float, _cycle_fraction: float) -> None:
        """Command the axis for the next `dt_s`, a fraction `cycle_fraction` of the communication cycle."""
        self.port.command_velocity(0.0)

    def check(self, _dt_s: float) -> None:
        """Supervise the actual values after a tick."""
