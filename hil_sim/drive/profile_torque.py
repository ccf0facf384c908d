"""Profile torque mode: the torque demand ramps to 6071h at the slope 6087h (linear, 6088h is 0)."""

from hil_sim.drive.mode import TARGET_REACHED, Mode


class ProfileTorque(Mode):
    """PT: demand within 6072h; bit 10 once it equals the target torque."""

    def enter(self) -> None:
        """Start at the actual torque."""
        self._start(float(self.objects.torque_actual_value))

    def resume(self, _position: float) -> None:
        """Start at zero torque: the axis is at standstill."""
        self._start(0.0)

    def _start(self, torque: float) -> None:
        self._torque = torque
        self.status = 0

    def leave(self) -> None:
        """Clear the torque demand, which the amplifier's own loops compute in the other modes."""
        super().leave()
        self.objects.torque_demand = 0

    def tick(self, dt_s: float, _cycle_fraction: float) -> None:
        """Advance the demand along its slope and command it."""
        objects = self.objects
        largest = objects.max_torque
        target = max(-largest, min(largest, objects.target_torque))
        if self.limits.switched:
            target = self.limits.torque(target)
        step = objects.torque_slope * dt_s
        self._torque += max(-step, min(step, target - self._torque))
        self.status = TARGET_REACHED if self._torque == objects.target_torque else 0
        demand = round(self._torque)
        objects.torque_demand = demand
        torque = max(-largest, min(largest, demand + objects.torque_offset))
        if abs(objects.velocity_actual_value) >= self.limits.motor_speed:
            torque = self.limits.torque(torque)
        self.port.command_torque(torque)
