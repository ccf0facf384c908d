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
    "quadratic_viscous_friction": friction.quadratic_viscous,
    "presliding_hysteresis": friction.presliding,
    "dwell_dependent_breakaway": friction.dwell,
    "position_dependent_friction": friction.position_dependent,
    "temperature_dependent_friction": friction.temperature_dependent,
    "backlash": transmission.backlash,
    "drive_compliance": transmission.compliance,
    "lead_error_cumulative": transmission.lead_error_cumulative,
    "lead_error_periodic": transmission.lead_error_periodic,
    "encoder_eccentricity": transmission.eccentricity,
    "thermal_expansion": transmission.expansion,
    "cogging": force.cogging,
    "torque_ripple": force.torque_ripple,
    "torque_constant_saturation": force.torque_constant_saturation,
    "current_loop_lag": force.current_loop_lag,
    "amplifier_dead_zone": force.dead_zone,
    "transport_delay": force.transport_delay,
    "voltage_saturation": force.voltage_saturation,
    "scale_cyclic_error": transmission.interpolation_error,
    "constant_force": force.constant,
    "position_dependent_force": force.position_force,
    "periodic_disturbance": force.disturbance,
    "cross_axis_coupling": force.coupling,
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
