"""Draw physics that is not in the catalogue: the right verdict on it is `unknown`."""

import math
from collections.abc import Callable

from tests.campaigns.blind.case import Planted
from tests.campaigns.blind.plant import Plant
from tests.campaigns.blind.setting import Drawn, Setting, sign

CAUSE = ("foreign",)


def _named(name: str, also: tuple[str, ...] = ()) -> Planted:
    return Planted(name, {}, CAUSE, catalogue=False, also=also)


def _bump(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        local_force_n=s.rng.uniform(0.4, 1.0) * p.coulomb_n * sign(s.rng),
        local_force_at_m=s.rng.uniform(-0.15, 0.15) * s.reach.travel_m,
        local_force_width_m=s.rng.uniform(0.02, 0.06) * s.reach.travel_m,
    )
    return plant, _named("bump_of_force_at_a_place", ("position_dependent_force", "constant_force"))


def _lean(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        force_step_n=s.rng.uniform(0.3, 0.8) * p.coulomb_n * sign(s.rng),
        force_step_at_s=s.rng.uniform(3.0, 7.0),
    )
    return plant, _named("step_of_force_in_time", ("constant_force", "asymmetric_coulomb_friction"))


def _starved(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        friction_step_n=s.rng.uniform(0.3, 0.7) * p.coulomb_n, friction_step_at_s=s.rng.uniform(3.0, 7.0)
    )
    return plant, _named("jump_of_friction_in_time", ("temperature_dependent_friction",))


def _relaxing(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        relaxation_n_s_m=s.rng.uniform(0.5, 1.0) * p.coulomb_n / (0.4 * s.reach.velocity_m_s),
        relaxation_s=math.exp(s.rng.uniform(math.log(0.06), math.log(0.4))),
    )
    return plant, _named("viscoelastic_relaxation")


def _aside(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        absorber_kg=s.rng.uniform(0.1, 0.25) * (p.motor_kg + p.table_kg),
        absorber_rad_s=2.0 * math.pi * s.rng.uniform(6.0, 25.0),
        absorber_damping=s.rng.uniform(0.02, 0.1),
    )
    return plant, _named("mass_on_a_spring")


def _loaded(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(
        mass_step_kg=s.rng.uniform(0.3, 0.6) * (p.motor_kg + p.table_kg),
        mass_step_at_s=s.rng.uniform(3.0, 7.0),
    )
    return plant, _named("load_changed_midway", ("payload_mass",))


def _late_jump(p: Plant, s: Setting) -> Drawn:
    plant = p._replace(delay_after_step_s=s.rng.uniform(3e-3, 8e-3), delay_step_at_s=s.rng.uniform(3.0, 7.0))
    return plant, _named("dead_time_that_jumps", ("transport_delay", "current_loop_lag"))._replace(
        causes=("delay",)
    )


FOREIGN: dict[str, Callable[[Plant, Setting], Drawn]] = {
    "bump_of_force_at_a_place": _bump,
    "step_of_force_in_time": _lean,
    "jump_of_friction_in_time": _starved,
    "viscoelastic_relaxation": _relaxing,
    "mass_on_a_spring": _aside,
    "load_changed_midway": _loaded,
    "dead_time_that_jumps": _late_jump,
}
"""The slow wander of a scale belongs to the sensors: see `draws`."""
