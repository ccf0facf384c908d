"""How an enabled axis stops: the option codes 605Ah to 605Eh, and the ramp that each selects."""

import math
from enum import Enum

from hil_sim.drive.axis_port import AxisPort
from hil_sim.drive.drive_objects import DriveObjects

STANDSTILL_WAIT_MAX_S = 0.5
"""Bounds the wait for standstill after the end of a ramp, in case the axis still creeps; chosen."""


class Ramp(Enum):
    """The deceleration of a stop."""

    SLOW_DOWN = "slow down ramp"  # 6084h, in homing 609Ah
    QUICK_STOP = "quick stop ramp"  # 6085h
    LIMIT = "current or voltage limit"  # at the current limit of the amplifier


HALT: dict[int, Ramp] = {1: Ramp.SLOW_DOWN, 2: Ramp.QUICK_STOP, 3: Ramp.LIMIT, 4: Ramp.LIMIT}
"""Halt option code 605Dh."""
FAULT_REACTION: dict[int, Ramp | None] = {0: None, **HALT}
"""Fault reaction option code 605Eh; None switches the power stage off at once."""
QUICK_STOP: dict[int, Ramp | None] = FAULT_REACTION | {code + 4: ramp for code, ramp in HALT.items()}
"""Quick stop option code 605Ah; 5 to 8 remain in quick stop active."""
SHUTDOWN: dict[int, Ramp | None] = {0: None, 1: Ramp.SLOW_DOWN}
"""Shutdown option code 605Bh."""
DISABLE_OPERATION = SHUTDOWN
"""Disable operation option code 605Ch, with the codes of 605Bh."""


def remains_in_quick_stop(option_code: int) -> bool:
    """Return whether the drive remains in quick stop active after the ramp of 605Ah."""
    return option_code >= 5


class StopRamp:
    """A velocity demand (counts/s) that falls to zero at a constant deceleration (counts/s^2).

    In the position loop the position demand (user counts) is its integral: the axis stops v^2 / (2 a) ahead.
    """

    def __init__(self, objects: DriveObjects, port: AxisPort) -> None:
        self._objects = objects
        self._port = port
        self.velocity = 0.0
        self.position = 0.0
        self.in_position_loop = False
        self._deceleration = math.inf
        self._at_standstill_s = 0.0

    def begin(self, velocity: float, deceleration: float, position: float | None) -> None:
        """Brake from `velocity` (counts/s); `position` is the demand of a closed position loop, else None."""
        self.velocity = velocity
        self._deceleration = deceleration
        self.in_position_loop = position is not None
        self.position = position if position is not None else 0.0
        self._at_standstill_s = 0.0

    def tick(self, dt_s: float, _cycle_fraction: float) -> None:
        """Advance the demand by `dt_s` and command it."""
        before = self.velocity
        change = self._deceleration * dt_s
        if abs(before) <= change:
            self.position += 0.5 * before * abs(before) / self._deceleration
            self.velocity = 0.0
            self._at_standstill_s += dt_s
        else:
            self.velocity = before - math.copysign(change, before)
            self.position += 0.5 * (before + self.velocity) * dt_s
        if self.in_position_loop:
            self._port.store_demand(self.position, self.velocity)
            self._port.command_position(self.position)
        else:
            self._objects.velocity_demand_value = round(self.velocity)
            self._port.command_velocity(self.velocity)

    def done(self) -> bool:
        """Return whether the ramp has ended and the axis stands still."""
        if self.velocity or not self._at_standstill_s:
            return False
        slow = abs(self._objects.velocity_actual_value) <= self._objects.velocity_threshold
        return slow or self._at_standstill_s > STANDSTILL_WAIT_MAX_S
