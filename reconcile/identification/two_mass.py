"""Two-mass identification: spring, damper and backlash between motor and table, by the whole plant.

The columns of the two channels give a backlash gap and a stiffness, but neither the damping of the spring nor
the impact on a flank. These come from an output-error fit of the plant along the recordings (`two_mass_fit`).
"""

from typing import NamedTuple

from hil_sim.config import PlantConfig
from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from hil_sim.physics.transmission import drive_compliance
from kernels.quantities import fields_of, section_of
from reconcile.identification.explain import Explanation
from reconcile.identification.two_mass_fit import (
    COULOMB,
    DAMPING,
    PLAY,
    STIFFNESS,
    FreeParameter,
    TwoMassFit,
    fit_two_mass,
)
from reconcile.identification.two_mass_recording import two_mass_recordings
from reconcile.selection.block_statistics import log_ratio_t

LEAST_STANDARD_ERRORS = 4.0
"""Least significance of the improvement over the starting values, in standard errors."""
TABLE, MOTOR = ("mechanics", "table_mass_kg"), ("mechanics", "motor_mass_kg")
VISCOUS = ("viscous_friction", "viscous_n_s_m")
UPPER_BOUNDS = {
    ("drive_compliance", field.name): field.quantity.upper for field in fields_of(drive_compliance.Params)
}
"""Upper bounds of the plant's parameters."""
SENSOR_EFFECTS = frozenset(
    section_of(module) for module in of_kind(Kind.ENCODER_READING, Kind.SCALE_READING, Kind.CROSS_READING)
)
"""Effects of the sensors: with one of them the scale does not measure the table."""


class TwoMassModel(NamedTuple):
    """The fit and the plant that it was made with."""

    fit: TwoMassFit
    plant: PlantConfig
    axis: int
    """Index of the axis in the plant."""


def identify_two_mass(
    plant: PlantConfig, name: str, deviation: Explanation, *, play: bool, free_spring: bool, own_rotor: bool
) -> TwoMassModel | None:
    """Fit the whole plant; None where it does not improve on the starting values significantly.

    `play`: backlash was identified, and is fitted too; `free_spring`: no stiffness was identified, so it is
    searched widely; `own_rotor`: the model has the rotor's mass, which is not fitted.
    """
    axis = plant.axes[name]
    if not SENSOR_EFFECTS.isdisjoint(axis.effects):
        return None
    recordings = two_mass_recordings(deviation.residuals)
    free_parameters = _free_parameters(plant, name, play=play, free_spring=free_spring, own_rotor=own_rotor)
    if not any(one.used.any() for one in recordings):
        return None
    number = list(plant.axes).index(name)
    fit = fit_two_mass(plant, number, free_parameters, recordings)
    if fit.at_bound or log_ratio_t(fit.blocks, fit.at_start) < LEAST_STANDARD_ERRORS:
        return None
    return TwoMassModel(fit, plant, number)


def _free_parameters(
    plant: PlantConfig, name: str, *, play: bool, free_spring: bool, own_rotor: bool
) -> list[FreeParameter]:
    """Parameters to fit with start, bounds and steps."""
    axis, dt_s = plant.axes[name], plant.dt_s
    table_kg, motor_kg = axis.table.mass_kg, axis.motor_mass_kg
    reduced_kg = table_kg * motor_kg / (table_kg + motor_kg)
    spring = axis.effects["drive_compliance"]
    stiffness_n_m, damping_n_s_m = spring.stiffness_n_m, spring.damping_n_s_m
    # stiffness * dt^2 + 2 * damping * dt < reduced mass keeps the substeps stable
    softest, stiffest = (0.05, 50.0) if free_spring else (0.5, 2.0)
    free = [
        FreeParameter(
            name=STIFFNESS,
            start=stiffness_n_m,
            low=softest * stiffness_n_m,
            high=min(stiffest * stiffness_n_m, UPPER_BOUNDS[STIFFNESS], 0.25 * reduced_kg / dt_s**2),
            step=0.4 if free_spring else 0.02,
            fine=0.003,
            grid=(0.15, 0.4, 1.0, 2.5) if free_spring else (1.0,),
        ),
        FreeParameter(
            name=DAMPING,
            start=damping_n_s_m,
            low=damping_n_s_m / 60.0,
            high=min(60.0 * damping_n_s_m, UPPER_BOUNDS[DAMPING], 0.37 * reduced_kg / dt_s),
            step=0.3,
            fine=0.003,
            grid=(0.3, 1.0, 3.0),
        ),
        _around(TABLE, table_kg, 0.7, 1.4, step=0.005, fine=0.0003),
    ]
    if play:
        free.append(_around(PLAY, axis.effects["backlash"].play_m, 0.3, 3.0, step=0.01, fine=0.0003))
    if not own_rotor:
        free.append(_around(MOTOR, motor_kg, 0.1, 3.0, step=0.2, fine=0.003))
    for key, step, fine in ((COULOMB, 0.005, 0.0003), (VISCOUS, 0.02, 0.001)):
        value = float(getattr(axis.effects.get(key[0]), key[1], 0.0))
        if value > 0.0:
            free.append(_around(key, value, least=0.3, most=3.0, step=step, fine=fine))
    return free


def _around(
    name: tuple[str, str], start: float, least: float, most: float, step: float, fine: float
) -> FreeParameter:
    """A parameter between `least` and `most` times its start."""
    return FreeParameter(name=name, start=start, low=least * start, high=most * start, step=step, fine=fine)
