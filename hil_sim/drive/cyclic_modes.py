"""The cyclic synchronous modes (CSP, CSV, CST): the controller sends a set point every cycle.

Their tick is compiled (`hil_sim.cyclic.drive_step`), for one axis or for all axes at once.
"""

from hil_sim.drive.mode import BIT_12, Mode, ModeCode

FOLLOWS_COMMAND = BIT_12


class CyclicMode(Mode):
    """Follows the set points of the bus."""

    def enter(self) -> None:
        """Start to follow at the actual position."""
        self.resume(float(self.port.position))

    def resume(self, position: float) -> None:
        """Start to follow at standstill at `position`."""
        self.port.start_interpolation(position)
        self.status = FOLLOWS_COMMAND

    def tick(self, dt_s: float, cycle_fraction: float) -> None:
        """Command the set point and its offsets."""
        self.port.follow_set_points(dt_s, cycle_fraction)


class CyclicTorque(CyclicMode):
    """CST: target torque plus torque offset, within 6072h."""

    cyclic_code = ModeCode.CYCLIC_TORQUE

    def leave(self) -> None:
        """Clear the torque demand, which the amplifier's own loops compute in the other modes."""
        super().leave()
        self.objects.torque_demand = 0


class CyclicVelocity(CyclicMode):
    """CSV: target velocity plus offset, in the amplifier's velocity loop."""

    cyclic_code = ModeCode.CYCLIC_VELOCITY

    def enter(self) -> None:
        """Start to follow at the actual velocity."""
        super().resume(float(self.objects.velocity_actual_value))

    def resume(self, _position: float) -> None:
        """Start to follow at standstill."""
        super().resume(0.0)


class CyclicPosition(CyclicMode):
    """CSP: target position plus offset, in the amplifier's position loop."""

    cyclic_code = ModeCode.CYCLIC_POSITION
    position_loop = True
