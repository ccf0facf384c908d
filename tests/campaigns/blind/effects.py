"""The effects that can be concealed, by name."""

from collections.abc import Callable

from tests.campaigns.blind import effects_force as force
from tests.campaigns.blind import effects_friction as friction
from tests.campaigns.blind import effects_transmission as transmission
from tests.campaigns.blind.plant import Plant
from tests.campaigns.blind.setting import Drawn, Setting

CATALOGUE: dict[str, Callable[[Plant, Setting], Drawn]] = {
    "asymmetric_coulomb_friction": friction.asymmetric_coulomb,
    "asymmetric_viscous_friction": friction.asymmetric_viscous,
    "stribeck_friction": friction.stribeck,
    "quadratic_viscous_friction": friction.drag,
    "presliding_hysteresis": friction.presliding,
    "dwell_dependent_breakaway": friction.dwell,
    "position_dependent_friction": friction.worn,
    "temperature_dependent_friction": friction.thin,
    "backlash": transmission.backlash,
    "drive_compliance": transmission.compliance,
    "lead_error_cumulative": transmission.stretch,
    "lead_error_periodic": transmission.wobble,
    "encoder_eccentricity": transmission.eccentric,
    "thermal_expansion": transmission.expansion,
    "cogging": force.cogging,
    "torque_ripple": force.torque_ripple,
    "torque_constant_saturation": force.saturation,
    "current_loop_lag": force.lag,
    "amplifier_dead_zone": force.dead_zone,
    "transport_delay": force.delay,
    "voltage_saturation": force.voltage,
    "scale_cyclic_error": transmission.cyclic,
    "constant_force": force.weight,
    "position_dependent_force": force.chain,
    "periodic_disturbance": force.hum,
    "cross_axis_coupling": force.tow,
}
"""Every effect of the catalogue except `payload_mass`, which a fitted mass always contains."""
COMMAND_ONLY = frozenset({"current_loop_lag", "amplifier_dead_zone", "transport_delay", "voltage_saturation"})
"""Effects between command and current: a measured current does not show them."""
CONFLICTS = (
    {"asymmetric_coulomb_friction", "constant_force"},
    {"lead_error_periodic", "encoder_eccentricity"},
    {"current_loop_lag", "transport_delay"},
    {"lead_error_periodic", "backlash"},
    {"torque_constant_saturation", "voltage_saturation"},
)
"""Pairs that are not planted together: of one class, or one would mask the other."""
