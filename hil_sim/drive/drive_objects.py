"""Process objects of the CiA 402 drive. Units: counts of the encoder, counts/s, counts/s^2, per mille."""

from typing import ClassVar, Protocol

from hil_sim.node.process_objects import Address, ProcessObjects, cia


class Sensors(Protocol):
    """The source of objects that are computed at every access."""

    position_gain_1_s: float
    """Gain of the amplifier's position loop."""

    def motor_counts(self) -> int:
        """Return motor counts from the power-up origin, without polarity."""

    def sensor_velocity(self, selection: int) -> int:
        """Return the velocity (increments/s) of the sensor that 606Ah selects."""


class DriveObjects(ProcessObjects):
    """One attribute per object that a PDO may map or that affects the drive; the EDS has types and limits."""

    COMPUTED: ClassVar[dict[Address, str]] = {
        (0x6063, 0): "position_actual_internal_value",
        (0x6069, 0): "velocity_sensor_actual_value",
        (0x60FA, 0): "control_effort",
    }
    sensors: Sensors | None = None

    homing_current_threshold: int = cia(0x2010, 1)  # per mille
    homing_current_threshold_time: int = cia(0x2010, 2)  # ms
    brake_release_time: int = cia(0x2011, 1)  # ms
    brake_set_time: int = cia(0x2011, 2)  # ms
    abort_connection_option_code: int = cia(0x6007)
    error_code: int = cia(0x603F)
    controlword: int = cia(0x6040)
    statusword: int = cia(0x6041)
    quick_stop_option_code: int = cia(0x605A)
    shutdown_option_code: int = cia(0x605B)
    disable_operation_option_code: int = cia(0x605C)
    halt_option_code: int = cia(0x605D)
    fault_reaction_option_code: int = cia(0x605E)
    modes_of_operation: int = cia(0x6060)
    modes_of_operation_display: int = cia(0x6061)
    position_demand_value: int = cia(0x6062)
    position_actual_value: int = cia(0x6064)
    following_error_window: int = cia(0x6065)
    following_error_time_out: int = cia(0x6066)  # ms
    position_window: int = cia(0x6067)
    position_window_time: int = cia(0x6068)  # ms
    sensor_selection_code: int = cia(0x606A)
    velocity_demand_value: int = cia(0x606B)
    velocity_actual_value: int = cia(0x606C)
    velocity_window: int = cia(0x606D)
    velocity_window_time: int = cia(0x606E)  # ms
    velocity_threshold: int = cia(0x606F)
    velocity_threshold_time: int = cia(0x6070)  # ms
    target_torque: int = cia(0x6071)
    max_torque: int = cia(0x6072)
    max_current: int = cia(0x6073)
    torque_demand: int = cia(0x6074)
    motor_rated_current: int = cia(0x6075)  # mA
    motor_rated_torque: int = cia(0x6076)  # mNm
    torque_actual_value: int = cia(0x6077)
    current_actual_value: int = cia(0x6078)
    target_position: int = cia(0x607A)
    home_offset: int = cia(0x607C)
    min_position_range_limit: int = cia(0x607B, 1)
    max_position_range_limit: int = cia(0x607B, 2)
    min_position_limit: int = cia(0x607D, 1)
    max_position_limit: int = cia(0x607D, 2)
    polarity: int = cia(0x607E)
    max_profile_velocity: int = cia(0x607F)
    max_motor_speed: int = cia(0x6080)  # 1/min
    profile_velocity: int = cia(0x6081)
    end_velocity: int = cia(0x6082)
    profile_acceleration: int = cia(0x6083)
    profile_deceleration: int = cia(0x6084)
    quick_stop_deceleration: int = cia(0x6085)
    motion_profile_type: int = cia(0x6086)
    torque_slope: int = cia(0x6087)  # per mille/s
    torque_profile_type: int = cia(0x6088)
    homing_method: int = cia(0x6098)
    speed_during_search_for_switch: int = cia(0x6099, 1)
    speed_during_search_for_zero: int = cia(0x6099, 2)
    homing_acceleration: int = cia(0x609A)
    profile_jerk: int = cia(0x60A4, 1)
    position_offset: int = cia(0x60B0)
    velocity_offset: int = cia(0x60B1)
    torque_offset: int = cia(0x60B2)
    touch_probe_function: int = cia(0x60B8)
    touch_probe_status: int = cia(0x60B9)
    touch_probe_1_positive_edge: int = cia(0x60BA)
    touch_probe_1_negative_edge: int = cia(0x60BB)
    touch_probe_2_positive_edge: int = cia(0x60BC)
    touch_probe_2_negative_edge: int = cia(0x60BD)
    interpolation_data_record: int = cia(0x60C1, 1)
    interpolation_time_period_value: int = cia(0x60C2, 1)
    interpolation_time_index: int = cia(0x60C2, 2)
    actual_buffer_size: int = cia(0x60C4, 2)
    max_acceleration: int = cia(0x60C5)
    max_deceleration: int = cia(0x60C6)
    positive_torque_limit_value: int = cia(0x60E0)
    negative_torque_limit_value: int = cia(0x60E1)
    additional_position_actual_value: int = cia(0x60E4, 1)
    additional_velocity_actual_value: int = cia(0x60E5, 1)
    positioning_option_code: int = cia(0x60F2)
    following_error_actual_value: int = cia(0x60F4)
    max_slippage: int = cia(0x60F8)
    position_demand_internal_value: int = cia(0x60FC)
    digital_inputs: int = cia(0x60FD)
    physical_outputs: int = cia(0x60FE, 1)
    bit_mask: int = cia(0x60FE, 2)
    target_velocity: int = cia(0x60FF)

    @property
    def position_actual_internal_value(self) -> int:
        """Position of the motor encoder (increments)."""
        return self.sensors.motor_counts() if self.sensors is not None else 0

    @property
    def velocity_sensor_actual_value(self) -> int:
        """Velocity of the sensor that 606Ah selects (increments/s)."""
        return self.sensors.sensor_velocity(self.sensor_selection_code) if self.sensors is not None else 0

    @property
    def control_effort(self) -> int:
        """Output of the position loop (counts/s)."""
        gain_1_s = self.sensors.position_gain_1_s if self.sensors is not None else 0.0
        return round(gain_1_s * self.following_error_actual_value)
