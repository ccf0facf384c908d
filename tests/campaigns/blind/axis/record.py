"""The columns of a simulation: what can be measured, and the force that each cause takes from the motor."""

from typing import NamedTuple

from tests.campaigns.blind.axis.step import AxisState, Forces
from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.plant import Plant


class Signals(NamedTuple):
    """Positions in metres, forces in newtons."""

    motor_m: float
    table_m: float
    encoder_m: float
    scale_m: float
    command_n: float
    current_n: float
    velocity_m_s: float
    """Of the motor, before the step."""
    coulomb_friction_n: float


class Causes(NamedTuple):
    """Additional forces that the motor must supply, newtons."""

    presliding: float
    coulomb_asymmetry: float
    viscous_asymmetry: float
    stribeck: float
    quadratic: float
    dwell: float
    position_friction: float
    temperature: float
    constant: float
    position_force: float
    disturbance: float
    foreign: float
    coupling: float
    cogging: float
    clutter: float
    torque_ripple: float
    saturation: float
    dead_zone: float
    current_loop: float
    delay: float
    voltage: float
    noise: float


SIGNALS, CAUSES = Signals._fields, Causes._fields
AT = {name: index for index, name in enumerate((*SIGNALS, *CAUSES))}
"""Column of each signal and cause in the rows of `simulate.run`."""
FIRST_CAUSE, WIDTH = len(SIGNALS), len(AT)


@compiled
def causes(p: Plant, command_n: float, forces: Forces, after: AxisState, z: float, noise_n: float) -> Causes:
    """Return the additional forces of a step; `z` is the hysteretic variable of both bodies."""
    drive, rubbing, on_table = forces.drive, forces.friction, forces.load
    table_m_s = after.bodies.table_m_s
    sign = 1.0 if table_m_s > 0.0 else (-1.0 if table_m_s < 0.0 else 0.0)
    return Causes(
        presliding=p.coulomb_n * (z - sign),
        coulomb_asymmetry=p.coulomb_asymmetry_n * z * z,
        viscous_asymmetry=rubbing.viscous_asymmetry_n,
        stribeck=rubbing.stribeck_n * z,
        quadratic=rubbing.quadratic_n,
        dwell=rubbing.dwell_n * z,
        position_friction=rubbing.position_n * z,
        temperature=(rubbing.temperature_factor - 1.0) * (p.coulomb_n * z + p.viscous_n_s_m * table_m_s),
        constant=p.constant_n,
        position_force=on_table.position_n,
        disturbance=on_table.disturbance_n,
        foreign=on_table.foreign_n + rubbing.step_n * z + on_table.absorber_n + forces.added_mass_n,
        coupling=on_table.coupling_n,
        cogging=forces.cogging_n,
        clutter=forces.clutter_n,
        torque_ripple=drive.developed_n * (1.0 - drive.torque_ratio),
        saturation=drive.limited_n - drive.developed_n,
        dead_zone=drive.command_n - drive.after_dead_zone_n,
        current_loop=drive.after_dead_zone_n - drive.current_n,
        delay=command_n - drive.command_n,
        voltage=drive.current_n - drive.limited_n,
        noise=noise_n,
    )
