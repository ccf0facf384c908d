"""The interface of one amplifier to its axis: views of the plant's records, and the drive's scaling.

Positions are user counts: motor counts times the sign of 607Eh, plus an origin that homing shifts. Only the
values in process objects wrap at the position range 607Bh.
"""

import math
from typing import Any

from numpy.typing import NDArray

from hil_sim.config import AxisPlant, Plant
from hil_sim.cyclic import drive_limits, drive_readings, drive_step
from hil_sim.cyclic.drive_record import drive_records, store_fields
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.motor_encoder import MotorEncoder
from hil_sim.drive.position_range import PositionRange
from hil_sim.plant.amplifier import OFF
from hil_sim.plant.measured_point import velocity_field

POSITION_REVERSED, VELOCITY_REVERSED, TORQUE_REVERSED = 0x80, 0x40, 0x20
"""Bits of the polarity 607Eh."""
SCALE_SENSOR = 1
"""Value of the sensor selection code 606Ah; 0 is the motor encoder."""
CARRIED = "carried_velocity_m_s"
"""Field of the plant's state that the scale of an axis with a structural mode measures."""
PER_MILLE = 1000.0
"""Torque and current objects are in thousandths of the rated value (CiA 402)."""


class AxisPort:
    """Commands to and feedback from axis `index` of the plant.

    Its state is a `DriveRecord`, which with the process objects is the memory of the compiled tick.
    """

    def __init__(self, config: AxisPlant, plant: Plant, index: int, objects: DriveObjects) -> None:
        own = slice(index, index + 1)
        self._states, self._setpoints = plant.state[own], plant.setpoint[own]
        self._state, self._setpoint = plant.state[index], plant.setpoint[index]
        self.encoder = MotorEncoder(config, self._state)
        motor = config.motor
        self._rated_current_a = motor.rated_current_ma * 1e-3
        rated_torque_nm = motor.rated_torque_mnm * 1e-3
        self._a_per_torque = rated_torque_nm / PER_MILLE / motor.torque_constant_nm_a
        self._limit_a = self._peak_a = config.amplifier.peak_current_a
        self.has_scale = config.scale is not None
        self.position_gain_1_s: float = config.amplifier.position_gain_1_s
        home = config.home_switch
        self.move_to(drive_records(1), objects.records)
        store_fields(
            self.record,
            counts_per_m=config.encoder.counts_per_rev / config.lead_m,
            m_per_count=config.lead_m / config.encoder.counts_per_rev,
            a_per_torque=self._a_per_torque,
            torque_per_a=1.0 / self._a_per_torque,
            current_per_a=PER_MILLE / self._rated_current_a,
            scale_counts_per_m=1e6 / config.scale.resolution_um if config.scale else 0.0,
            carried=velocity_field(plant.params[index]) == CARRIED,
            negative_m=config.limit_switches.negative_mm * 1e-3,
            positive_m=config.limit_switches.positive_mm * 1e-3,
            home_from_m=math.nan if home is None else home.from_mm * 1e-3,
            home_to_m=math.nan if home is None else home.to_mm * 1e-3,
        )
        self.range = PositionRange()
        self.set_polarity(0)

    def warm_up(self) -> None:
        """Compile the kernels that Python calls, or load them from the cache; nothing moves."""
        records, objects, setpoints = self._records.copy(), self._objects.copy(), self._setpoints.copy()
        drive_readings.read_axis(records, objects, self._states, 0)
        drive_readings.inputs_of(records, self._states, 0)
        drive_readings.check_following(records, objects, 0, 1.0)
        drive_step.store_demand(records, objects, 0, 0.0, 0.0)
        drive_limits.clip_position(records, objects, 0, 0.0)
        drive_limits.clip_velocity(records, objects, 0, 0.0, 1.0, 1.0)
        drive_limits.clip_torque(records, objects, 0, 0.0)
        drive_limits.clip_step(records, 0, 0.0, 0.0, 1.0)
        drive_readings.wrapped(0, 0, 0)
        drive_step.nearest_equivalent(0, 0.0, 0.0)
        drive_step.command_torque(records, setpoints, 0, 0.0)
        drive_step.command_velocity(records, setpoints, 0, 0.0, 0.0)
        drive_step.command_position(records, setpoints, 0, 0.0, 0.0, 0.0)

    def move_to(self, records: NDArray[Any], objects: NDArray[Any]) -> None:
        """Move record and process objects into these arrays (1,) of the bench."""
        if hasattr(self, "record"):
            records[0] = self.record
        self._records, self._objects = records, objects
        self.record: Any = records[0]
        """A `DriveRecord`."""

    @property
    def origin(self) -> int:
        """User counts where the motor counts are zero."""
        return int(self.record["origin"])

    @origin.setter
    def origin(self, counts: int) -> None:
        self.record["origin"] = counts

    @property
    def position(self) -> int:
        """Actual position (user counts) at the last `read`; 6064h shows it wrapped to the range."""
        return int(self.record["position"])

    @property
    def position_sign(self) -> int:
        """Sign of a position by 607Eh."""
        return int(self.record["position_sign"])

    @property
    def position_change_sign(self) -> int:
        """Sign of the position change at a positive velocity, in user units."""
        return int(self.record["velocity_sign"] * self.record["position_sign"])

    def set_polarity(self, polarity: int) -> None:
        """Apply the signs of 607Eh; a reversed position is mirrored at the origin."""
        store_fields(
            self.record,
            position_sign=-1 if polarity & POSITION_REVERSED else 1,
            velocity_sign=-1 if polarity & VELOCITY_REVERSED else 1,
            torque_sign=-1 if polarity & TORQUE_REVERSED else 1,
        )

    def read(self) -> None:
        """Write the actual values to the process objects. Raises ValueError if the plant has diverged."""
        if not drive_readings.read_axis(self._records, self._objects, self._states, 0):
            raise ValueError("the position of an axis is not a number: the plant is unstable")

    def store_demand(self, position: float, velocity: float) -> None:
        """Write the demand of the position loop: user counts; counts/s in the direction of the position."""
        drive_step.store_demand(self._records, self._objects, 0, float(position), float(velocity))

    def switches(self) -> int:
        """Return digital inputs 60FDh: bit 0 negative, bit 1 positive limit switch, bit 2 home switch."""
        return drive_readings.inputs_of(self._records, self._states, 0)

    def clip_position(self, demand: float) -> float:
        """Clip a position demand by the limits of travel."""
        return drive_limits.clip_position(self._records, self._objects, 0, float(demand))

    def clip_velocity(self, demand: float, deceleration: float, dt_s: float) -> float:
        """Clip a velocity demand (counts/s) so that braking at `deceleration` ends within the limits."""
        return drive_limits.clip_velocity(
            self._records, self._objects, 0, float(demand), float(deceleration), dt_s
        )

    def clip_step(self, before: float, demand: float, dt_s: float) -> float:
        """Clip a position demand so that it follows `before` within the max motor speed 6080h."""
        return drive_limits.clip_step(self._records, 0, float(before), float(demand), dt_s)

    def clip_torque(self, demand: int) -> int:
        """Clip a torque demand (per mille): none into a closed limit switch, none beyond speed 6080h."""
        return int(drive_limits.clip_torque(self._records, self._objects, 0, float(demand)))

    def start_interpolation(self, value: float) -> None:
        """Start the interpolation of a cyclic mode at `value`, without a ramp."""
        store_fields(self.record, present=value, start=value, target=value, progress=1.0)

    def follow_set_points(self, dt_s: float, cycle_fraction: float) -> None:
        """Command the set points of the cyclic mode for the next `dt_s`, `cycle_fraction` of the cycle."""
        drive_step.command_axes(self._records, self._objects, self._setpoints, dt_s, cycle_fraction)

    def check_following(self, dt_s: float) -> bool:
        """Update 60F4h; return whether the following error has been too large for too long."""
        return drive_readings.check_following(self._records, self._objects, 0, dt_s)

    def table_position_m(self) -> float:
        """Return the position of the table (m), which switches and touch probes of the machine sense."""
        return float(self._state["table_position_m"])

    def user_position(self, motor_counts: int) -> int:
        """Convert motor counts to a position as process objects show it, wrapped to the range."""
        return self.range.wrapped(self.origin + self.position_sign * motor_counts)

    def set_range(self, low: int, high: int) -> None:
        """Apply the position range limit 607Bh (counts)."""
        self.range.set_limits(low, high)
        store_fields(self.record, range_low=low, range_high=high, range_span=self.range.span)

    def move_into_range(self) -> int:
        """Move the origin so that the actual position lies in its range; return the change in counts."""
        shift = self.range.wrapped(self.position) - self.position
        self.origin += shift
        self.record["position"] += shift
        return shift

    def close_switch(self, *, positive: bool) -> None:
        """Close one of the limit switches permanently, at any position of the table."""
        if positive:
            self.record["positive_m"] = -math.inf
        else:
            self.record["negative_m"] = math.inf

    def sensor_velocity(self, selection: int) -> int:
        """Return the velocity (increments/s, without polarity) of the sensor that 606Ah selects."""
        state, record = self._state, self.record
        if selection == SCALE_SENSOR:
            field = CARRIED if record["carried"] else "table_velocity_m_s"
            return round(float(state[field] * record["scale_counts_per_m"]))
        return round(float(state["encoder_velocity_m_s"] * record["counts_per_m"]))

    def motor_counts(self) -> int:
        """Return motor counts from the power-up origin, without polarity."""
        return self.encoder.counts()

    def power_off(self) -> None:
        """Switch the power stage off: no current at any set point."""
        self._setpoint["loop"] = OFF

    def limit_torque(self, max_torque: int, max_current: int) -> None:
        """Apply the limits 6072h and 6073h (per mille)."""
        by_torque_a = max_torque * self._a_per_torque
        by_current_a = max_current * self._rated_current_a / PER_MILLE
        self._limit_a = min(by_torque_a, by_current_a)
        self._setpoint["current_limit_a"] = self._limit_a

    def limit_torque_direction(self, positive: int, negative: int) -> None:
        """Apply the limits 60E0h and 60E1h (per mille) of one direction, within those of both directions."""
        limit_a = min(self._limit_a, self._peak_a)
        reductions_a = [max(0.0, limit_a - torque * self._a_per_torque) for torque in (positive, negative)]
        if self.record["torque_sign"] < 0:
            reductions_a.reverse()
        self._setpoint["limit_reduction_positive_a"] = reductions_a[0]
        self._setpoint["limit_reduction_negative_a"] = reductions_a[1]

    def command_torque(self, torque: int) -> None:
        """Command a torque (per mille of the rated torque)."""
        drive_step.command_torque(self._records, self._setpoints, 0, float(torque))

    def command_velocity(self, velocity: float, torque_offset: int = 0) -> None:
        """Command a velocity (counts/s), reached linearly over the next advance of the plant."""
        drive_step.command_velocity(self._records, self._setpoints, 0, float(velocity), float(torque_offset))

    def command_position(self, position: float, torque_offset: int = 0) -> None:
        """Command a position (user counts), reached linearly over the next advance of the plant."""
        drive_step.command_position(
            self._records, self._setpoints, 0, float(position), 0.0, float(torque_offset)
        )
