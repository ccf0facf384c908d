"""Parameters of a concealed axis and its controller; 0 means that an effect is absent."""

from typing import NamedTuple


class Plant(NamedTuple):
    """The true axis, SI; positions in metres of travel, angles in rad, `_1_m` angular wave numbers."""

    # two bodies, or one where `flexible` is 0
    motor_kg: float = 10.0
    table_kg: float = 20.0
    has_compliance: float = 0.0
    contact_stiffness: float = 1e8  # N/m^power
    contact_power: float = 1.0
    contact_loss_s_m: float = 0.0  # Hunt and Crossley's
    spring_n_s_m: float = 0.0  # damping beside a linear contact
    backlash_gap_m: float = 0.0  # free travel
    # friction: Bouc-Wen's hysteretic variable times a level
    coulomb_n: float = 10.0
    viscous_n_s_m: float = 100.0
    presliding_m: float = 1e-6  # travel in which friction builds up
    sharpness: float = 2.0
    unloading: float = 0.5
    nut_share: float = 0.4  # share of the friction on the motor's side
    coulomb_asymmetry_n: float = 0.0  # half of the difference between the directions
    viscous_asymmetry_n_s_m: float = 0.0
    stribeck_n: float = 0.0  # rise towards standstill
    stribeck_m_s: float = 1.0
    stribeck_exponent: float = 2.0
    quadratic: float = 0.0  # N at 1 m/s
    quadratic_exponent: float = 2.0
    dwell_n: float = 0.0  # per e-fold of the dwell time
    dwell_s: float = 0.3
    dwell_reset_m: float = 2e-5
    position_friction_n: float = 0.0
    position_friction_at_m: float = 0.0
    position_friction_width_m: float = 0.1
    temperature_share: float = 0.0  # share of the friction that the temperature rise takes away
    # forces on the table
    constant_n: float = 0.0
    position_force_n: float = 0.0
    position_force_at_m: float = 0.0
    position_force_width_m: float = 0.1
    disturbance_n: float = 0.0
    disturbance_rad_s: float = 0.0
    disturbance_phase_rad: float = 0.0
    disturbance_skew: float = 0.0
    local_force_n: float = 0.0
    local_force_at_m: float = 0.0
    local_force_width_m: float = 1e-3
    force_step_n: float = 0.0
    force_step_at_s: float = 1e9
    friction_step_n: float = 0.0
    friction_step_at_s: float = 1e9
    relaxation_n_s_m: float = 0.0
    relaxation_s: float = 0.1
    absorber_kg: float = 0.0
    absorber_rad_s: float = 100.0
    absorber_damping: float = 0.05
    mass_step_kg: float = 0.0
    mass_step_at_s: float = 1e9
    coupled_kg: float = 0.0  # times the acceleration of another axis
    # between command and force
    dead_zone_n: float = 0.0
    dead_zone_rounding_n: float = 0.5
    delay_s: float = 0.0
    delay_after_step_s: float = 0.0
    delay_step_at_s: float = 1e9
    current_loop_rad_s: float = 0.0  # of the second-order current loop; 0: no lag
    current_loop_damping: float = 0.8
    stall_n: float = 0.0  # force at rest within the voltage
    no_load_m_s: float = 1.0
    saturation_n: float = 0.0  # arctangent saturation
    cogging_n: float = 0.0
    cogging_1_m: float = 0.0
    cogging_phase_rad: float = 0.0
    cogging_skew: float = 0.0
    clutter_n: float = 0.0  # cogging of another pitch that every axis has
    clutter_1_m: float = 0.0
    clutter_phase_rad: float = 0.0
    torque_ripple: float = 0.0
    torque_ripple_1_m: float = 0.0
    torque_ripple_phase_rad: float = 0.0
    torque_ripple_skew: float = 0.0
    # geometry and sensors
    lead_error_m: float = 0.0
    lead_error_1_m: float = 0.0
    lead_error_phase_rad: float = 0.0
    lead_error_second_m: float = 0.0  # second harmonic
    relative_lead_error: float = 0.0  # scale over motor, less 1
    eccentricity_m: float = 0.0
    eccentricity_1_m: float = 0.0
    eccentricity_phase_rad: float = 0.0
    interpolation_error_m: float = 0.0
    interpolation_error_1_m: float = 0.0
    interpolation_error_phase_rad: float = 0.0
    interpolation_error_skew: float = 0.0
    motor_count_m: float = 1e-8
    scale_count_m: float = 1e-7


class Loop(NamedTuple):
    """The sampled controller."""

    cascade: float  # 1: P-PI with a difference filter, 0: PID with a filtered D
    on_scale: float
    kp: float
    ki: float
    kd: float
    filter_hz: float
    viscous_feedforward_n_s_m: float
    mass_feedforward_kg: float
    force_limit_n: float
