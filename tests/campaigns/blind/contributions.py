"""Contribution of each concealed effect to the two residual channels: force, and scale less motor."""

import numpy as np

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.axis.record import AT, CAUSES
from tests.campaigns.blind.case import Case, Planted, SimulatedRecording
from tests.campaigns.blind.nonlinearities import wave

IN_THE_DRIVE = frozenset({"dead_zone", "current_loop", "delay", "voltage"})
"""Causes between command and current: a measured current does not show them."""
NOISE = frozenset({"noise"})


def force_n(case: Case, effect: Planted, inside: Array) -> Array:
    """Return the recorded force (n,) that the effect needs."""
    return _sum(case, effect.causes, inside)


def known_force_n(case: Case, inside: Array) -> Array:
    """Return the force (n,) of all effects, without noise and without mass, viscous and Coulomb friction."""
    return _sum(case, tuple(cause for cause in CAUSES if cause not in NOISE), inside)


def _sum(case: Case, causes: tuple[str, ...], inside: Array) -> Array:
    total = np.zeros(len(inside))
    for cause in causes:
        if case.sensing.is_command or cause not in IN_THE_DRIVE:
            total += inside[:, AT[cause]]
    return total


def deviation_m(case: Case, effect: Planted, recording: SimulatedRecording) -> Array:
    """Return the deviation (n,) between scale and motor that the effect makes, up to an origin."""
    p, start_m = case.plant, recording.start_m
    motor, table = recording.inside[:, AT["motor_m"]], recording.inside[:, AT["table_m"]]
    if not effect.deviation:
        return np.zeros(len(motor))
    if effect.name in {"backlash", "drive_compliance"}:
        # of both together, the backlash's is the step, the spring's the residual
        bend = table - motor - _bend(case, motor, start_m)
        step = np.clip(bend, -0.5 * p.backlash_gap_m, 0.5 * p.backlash_gap_m)
        return step if effect.name == "backlash" else bend - step
    shapes = {
        "lead_error_periodic": lambda: _bend(case, motor, start_m),
        "lead_error_cumulative": lambda: p.relative_lead_error * table,
        "thermal_expansion": lambda: recording.growth_m,
        "encoder_eccentricity": lambda: (
            -p.eccentricity_m * np.sin(p.eccentricity_1_m * (motor + start_m) + p.eccentricity_phase_rad)
        ),
        "scale_cyclic_error": lambda: (
            p.interpolation_error_m
            * wave(
                p.interpolation_error_1_m * (table + start_m) + p.interpolation_error_phase_rad,
                p.interpolation_error_skew,
            )
        ),
        "wander_of_the_scale": lambda: recording.wander_m,
    }
    values: Array = shapes[effect.name]()
    return values


def _bend(case: Case, motor: Array, start_m: float) -> Array:
    p = case.plant
    angle = p.lead_error_1_m * (motor + start_m) + p.lead_error_phase_rad
    return np.asarray(p.lead_error_m * np.sin(angle) + p.lead_error_second_m * np.sin(2.0 * angle + 0.7))
