"""Which groups of less common effects an axis has: asked once a call, so that their absence costs nothing."""

from __future__ import annotations

from typing import Any, NamedTuple

from hil_sim.physics.jit import kernel


class Presence(NamedTuple):
    """Whether any effect of the group is there; the groups are the places where they are composed."""

    current_path: bool
    friction: bool
    load: bool
    encoder: bool


@kernel
def presence_of(p: Any) -> Presence:
    """The groups of one AXIS_PARAMS."""
    current_path = (
        p.amplifier_dead_zone.enabled
        + p.voltage_saturation.enabled
        + p.current_loop_lag.enabled
        + p.transport_delay.enabled
        + p.torque_constant_saturation.enabled
        + p.torque_ripple.enabled
    )
    friction = (
        p.position_dependent_friction.enabled
        + p.dwell_dependent_breakaway.enabled
        + p.asymmetric_coulomb_friction.enabled
        + p.asymmetric_viscous_friction.enabled
        + p.quadratic_viscous_friction.enabled
        + p.presliding_hysteresis.enabled
    )
    load = p.position_dependent_force.enabled + p.periodic_disturbance.enabled + p.payload_mass.enabled
    return Presence(current_path > 0, friction > 0, load > 0, p.encoder_eccentricity.enabled > 0)
