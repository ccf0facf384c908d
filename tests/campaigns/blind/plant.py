"""Parameters of a concealed axis and its controller; 0 means that an effect is absent."""

from typing import NamedTuple


class Plant(NamedTuple):
    """The true axis, SI; positions in metres of travel, angles in rad, `_1_m` angular wave numbers."""

    # two bodies, or one where `flexible` is 0
    motor_kg: float = 10.0
    table_kg: float = 20.0
    flexible: float = 0.0
    contact: float = 1e8  # N/m^power
    contact_power: float = 1.0
    contact_loss_s_m: float = 0.0  # Hunt and Crossley's
    spring_n_s_m: float = 0.0  # damping beside a linear contact
    gap_m: float = 0.0  # whole play
    # friction: Bouc-Wen's hysteretic variable times a level
    coulomb_n: float = 10.0
    viscous_n_s_m: float = 100.0
    presliding_m: float = 1e-6  # travel in which friction builds up
    sharpness: float = 2.0
    unloading: float = 0.5
    nut_share: float = 0.4  # of the friction, on the motor's side
    uneven_n: float = 0.0  # more forwards, less backwards
    uneven_n_s_m: float = 0.0
    rise_n: float = 0.0  # towards standstill
    rise_m_s: float = 1.0
    rise_power: float = 2.0
    drag: float = 0.0  # N at 1 m/s
    drag_power: float = 2.0
    age_n: float = 0.0  # per e-fold of the contact's age
    age_s: float = 0.3
    age_m: float = 2e-5
    worn_n: float = 0.0
    worn_at_m: float = 0.0
    worn_m: float = 0.1
    thin: float = 0.0  # share of the friction that the temperature rise changes
    # forces on the table
    weight_n: float = 0.0
    chain_n: float = 0.0
    chain_at_m: float = 0.0
    chain_m: float = 0.1
    hum_n: float = 0.0
    hum_rad_s: float = 0.0
    hum_rad: float = 0.0
    hum_skew: float = 0.0
    bump_n: float = 0.0
    bump_at_m: float = 0.0
    bump_m: float = 1e-3
    lean_n: float = 0.0
    lean_at_s: float = 1e9
    starved_n: float = 0.0
    starved_at_s: float = 1e9
    relaxing_n_s_m: float = 0.0
    relaxing_s: float = 0.1
    aside_kg: float = 0.0
    aside_rad_s: float = 100.0
    aside_damping: float = 0.05
    loaded_kg: float = 0.0
    loaded_at_s: float = 1e9
    towed_kg: float = 0.0  # of another axis, by its acceleration
    # between command and force
    lost_n: float = 0.0
    lost_smooth_n: float = 0.5
    late_s: float = 0.0
    later_s: float = 0.0
    later_at_s: float = 1e9
    slow_rad_s: float = 0.0  # second order
    slow_damping: float = 0.8
    stall_n: float = 0.0  # force that the voltage allows at rest
    no_load_m_s: float = 1.0
    full_n: float = 0.0  # arctangent of the iron
    detent_n: float = 0.0
    detent_1_m: float = 0.0
    detent_rad: float = 0.0
    detent_skew: float = 0.0
    small_n: float = 0.0  # a second one, of another pitch: clutter
    small_1_m: float = 0.0
    small_rad: float = 0.0
    uneven_torque: float = 0.0
    torque_1_m: float = 0.0
    torque_rad: float = 0.0
    torque_skew: float = 0.0
    # geometry and sensors
    wobble_m: float = 0.0
    wobble_1_m: float = 0.0
    wobble_rad: float = 0.0
    wobble_2_m: float = 0.0  # twice a turn
    stretch: float = 0.0  # scale per motor
    eccentric_m: float = 0.0
    eccentric_1_m: float = 0.0
    eccentric_rad: float = 0.0
    cyclic_m: float = 0.0
    cyclic_1_m: float = 0.0
    cyclic_rad: float = 0.0
    cyclic_skew: float = 0.0
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
    feed_velocity: float
    feed_acceleration: float
    limit_n: float
