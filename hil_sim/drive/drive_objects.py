"""Process objects of the CiA 402 drive. Units: counts of the encoder, counts/s, counts/s^2, per mille."""

from dataclasses import dataclass

from hil_sim.node.process_objects import ProcessObjects, cia


@dataclass(slots=True)
class DriveObjects(ProcessObjects):
    """One attribute per object that a PDO may map or the drive acts on; the EDS has types and limits."""

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
    min_position_limit: int = cia(0x607D, 1)
    max_position_limit: int = cia(0x607D, 2)
    polarity: int = cia(0x607E)
    max_profile_velocity: int = cia(0x607F)
    profile_velocity: int = cia(0x6081)
    profile_acceleration: int = cia(0x6083)
    profile_deceleration: int = cia(0x6084)
    quick_stop_deceleration: int = cia(0x6085)
    motion_profile_type: int = cia(0x6086)
    homing_method: int = cia(0x6098)
    speed_during_search_for_switch: int = cia(0x6099, 1)
    speed_during_search_for_zero: int = cia(0x6099, 2)
    homing_acceleration: int = cia(0x609A)
    position_offset: int = cia(0x60B0)
    velocity_offset: int = cia(0x60B1)
    torque_offset: int = cia(0x60B2)
    max_acceleration: int = cia(0x60C5)
    additional_position_actual_value: int = cia(0x60E4, 1)
    additional_velocity_actual_value: int = cia(0x60E5, 1)
    following_error_actual_value: int = cia(0x60F4)
    position_demand_internal_value: int = cia(0x60FC)
    digital_inputs: int = cia(0x60FD)
    target_velocity: int = cia(0x60FF)
