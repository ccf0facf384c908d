"""The interface of one amplifier to its axis: views on the plant's records, and the drive's scaling.

Positions are user counts: motor counts times the sign of 607Eh, plus an origin that homing moves. They run on
where clients see them begin anew (607Bh).
"""

import math
from typing import Any

from hil_sim.config import AxisPlant, Plant
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.position_range import PositionRange
from hil_sim.plant.amplifier import CURRENT, OFF, POSITION, VELOCITY
from hil_sim.plant.layout import SETPOINT
from hil_sim.plant.measured_point import velocity_field

POSITION_REVERSED, VELOCITY_REVERSED, TORQUE_REVERSED = 0x80, 0x40, 0x20  # polarity 607Eh
SCALE_SENSOR = 1  # sensor selection code 606Ah
HOME_SWITCH = 4  # digital inputs 60FDh
PER_MILLE = 1000.0  # units of torque and current objects in the rated value


class AxisPort:
    """Commands to and feedback from axis `index` of the plant, by memory views (no numpy in the cycle)."""

    def __init__(self, config: AxisPlant, plant: Plant, index: int) -> None:
        self._index = index
        state = plant.state
        self._setpoint: dict[str, Any] = {name: plant.setpoint[name].data for name in SETPOINT.names or ()}
        self._counts: Any = state["encoder_counts"].data
        self._encoder_velocity_m_s: Any = state["encoder_velocity_m_s"].data
        self._measured_a: Any = state["current_measured_a"].data
        self._table_position_m: Any = state["table_position_m"].data
        self._scale_velocity_m_s: Any = state[velocity_field(plant.params[index])].data
        self._scale_counts: Any = state["scale_counts"].data
        self.counts_per_rev = config.encoder.counts_per_rev
        self._m_per_count = config.lead_m / config.encoder.counts_per_rev
        self._counts_per_m = config.encoder.counts_per_rev / config.lead_m
        self._scale_counts_per_m = 1e6 / config.scale.resolution_um if config.scale else 0.0
        self._negative_m = config.limit_switches.negative_mm * 1e-3
        self._positive_m = config.limit_switches.positive_mm * 1e-3
        home = config.home_switch
        self._home_m = None if home is None else (home.from_mm * 1e-3, home.to_mm * 1e-3)
        pulse_counts = round(config.encoder.index_mm * 1e-3 * self._counts_per_m)
        self._pulse_counts = pulse_counts - int(state["encoder_origin_counts"][index])
        motor = config.motor
        self._rated_current_a = motor.rated_current_ma * 1e-3
        rated_torque_nm = motor.rated_torque_mnm * 1e-3
        self._a_per_torque = rated_torque_nm / PER_MILLE / motor.torque_constant_nm_a
        self._torque_per_a = 1.0 / self._a_per_torque
        self._current_per_a = PER_MILLE / self._rated_current_a
        self._limit_a = self._peak_a = config.amplifier.peak_current_a
        self.has_scale = config.scale is not None
        self.position_gain_1_s: float = config.amplifier.position_gain_1_s
        self.origin = 0  # user counts where the motor counts are zero
        self.range = PositionRange()
        self.position = 0
        """Actual position at the last `read`; 6064h shows it within the range."""
        self.set_polarity(0)

    def set_polarity(self, polarity: int) -> None:
        """Apply the signs of 607Eh; the actual position is mirrored at the origin."""
        self.position_sign = -1 if polarity & POSITION_REVERSED else 1
        self._velocity_sign = -1 if polarity & VELOCITY_REVERSED else 1
        self._torque_sign = -1 if polarity & TORQUE_REVERSED else 1
        # sign of the position change at a positive velocity, and under a positive torque, in user units
        self.velocity_side = self._velocity_sign * self.position_sign
        self.torque_side = self._torque_sign * self.position_sign

    def read(self, objects: DriveObjects) -> None:
        """Write the actual values to the process objects."""
        index = self._index
        position = self.position = self.origin + self.position_sign * self._counts[index]
        objects.position_actual_value = self.range.shown(position) if self.range.span else position
        velocity = self._velocity_sign * self._encoder_velocity_m_s[index]
        objects.velocity_actual_value = round(velocity * self._counts_per_m)
        current_a = self._torque_sign * self._measured_a[index]
        objects.current_actual_value = round(current_a * self._current_per_a)
        objects.torque_actual_value = round(current_a * self._torque_per_a)
        if self._scale_counts_per_m:
            objects.additional_position_actual_value = self._scale_counts[index]
            objects.additional_velocity_actual_value = round(
                self._scale_velocity_m_s[index] * self._scale_counts_per_m
            )

    def show_demand(self, objects: DriveObjects, position: float, velocity: float) -> None:
        """Write the demand of the position loop: user counts; counts/s in the direction of the position."""
        demand = round(position)
        objects.position_demand_internal_value = demand
        objects.position_demand_value = self.range.shown(demand) if self.range.span else demand
        objects.velocity_demand_value = round(self.velocity_side * velocity)

    def switches(self) -> int:
        """Digital inputs 60FDh: bit 0 negative, bit 1 positive limit switch, bit 2 home switch."""
        position_m = self._table_position_m[self._index]
        negative, positive = position_m <= self._negative_m, position_m >= self._positive_m
        inputs = int(negative) | int(positive) << 1
        if self._home_m is not None and self._home_m[0] <= position_m <= self._home_m[1]:
            inputs |= HOME_SWITCH
        return inputs

    def table_position_m(self) -> float:
        """Where the table is, for what stands at a place on the machine."""
        return float(self._table_position_m[self._index])

    def user_position(self, motor_counts: int) -> int:
        """Motor counts as a position that the user sees."""
        return self.range.shown(self.origin + self.position_sign * motor_counts)

    def into_range(self) -> int:
        """Put the zero where the actual position lies in its range; return by how much positions changed."""
        shift = self.range.shown(self.position) - self.position
        self.origin += shift
        self.position += shift
        return shift

    def close_switch(self, *, positive: bool) -> None:
        """Close one of the limit switches for good, wherever the table is."""
        if positive:
            self._positive_m = -math.inf
        else:
            self._negative_m = math.inf

    def sensor_velocity(self, selection: int) -> int:
        """Velocity (increments/s of the sensor, without polarity) of encoder (0) or scale (1), by 606Ah."""
        if selection == SCALE_SENSOR:
            velocity: float = self._scale_velocity_m_s[self._index] * self._scale_counts_per_m
        else:
            velocity = self._encoder_velocity_m_s[self._index] * self._counts_per_m
        return round(velocity)

    def motor_counts(self) -> int:
        """Motor counts from the power-up origin, without polarity."""
        return int(self._counts[self._index])

    def index_between(self, before: int, now: int) -> int | None:
        """Motor counts of the first index pulse passed between `before` and `now`, if any."""
        turn = self.counts_per_rev
        if now >= before:
            first = before + 1 + (self._pulse_counts - before - 1) % turn
            return first if first <= now else None
        first = before - 1 - (before - 1 - self._pulse_counts) % turn
        return first if first >= now else None

    def off(self) -> None:
        """Switch the power stage off: no current, whatever the set points."""
        self._setpoint["loop"][self._index] = OFF

    def limit_torque(self, max_torque: int, max_current: int) -> None:
        """Apply the limits 6072h and 6073h (per mille)."""
        by_torque_a = max_torque * self._a_per_torque
        by_current_a = max_current * self._rated_current_a / PER_MILLE
        self._limit_a = min(by_torque_a, by_current_a)
        self._setpoint["current_limit_a"][self._index] = self._limit_a

    def limit_direction(self, positive: int, negative: int) -> None:
        """Apply the limits 60E0h and 60E1h (per mille), below those of both directions."""
        limit_a = min(self._limit_a, self._peak_a)
        cuts_a = [max(0.0, limit_a - torque * self._a_per_torque) for torque in (positive, negative)]
        if self._torque_sign < 0:
            cuts_a.reverse()
        self._setpoint["current_cut_positive_a"][self._index] = cuts_a[0]
        self._setpoint["current_cut_negative_a"][self._index] = cuts_a[1]

    def command_torque(self, torque: int) -> None:
        """Torque set point (per mille)."""
        index, setpoint = self._index, self._setpoint
        setpoint["loop"][index] = CURRENT
        setpoint["current_offset_a"][index] = 0.0
        setpoint["current_a"][index] = self._torque_sign * torque * self._a_per_torque

    def command_velocity(self, velocity: float, torque_offset: int = 0) -> None:
        """Velocity set point (counts/s), reached linearly over the next advance."""
        index, setpoint = self._index, self._setpoint
        setpoint["loop"][index] = VELOCITY
        setpoint["velocity_offset_m_s"][index] = 0.0
        setpoint["current_offset_a"][index] = self._torque_sign * torque_offset * self._a_per_torque
        setpoint["velocity_m_s"][index] = self._velocity_sign * velocity * self._m_per_count

    def command_position(self, position: float, velocity_offset: int = 0, torque_offset: int = 0) -> None:
        """Position set point (user counts), reached linearly over the next advance."""
        index, setpoint = self._index, self._setpoint
        setpoint["loop"][index] = POSITION
        setpoint["velocity_offset_m_s"][index] = self._velocity_sign * velocity_offset * self._m_per_count
        setpoint["current_offset_a"][index] = self._torque_sign * torque_offset * self._a_per_torque
        setpoint["position_m"][index] = self.position_sign * (position - self.origin) * self._m_per_count
