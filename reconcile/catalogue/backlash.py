"""Backlash: scale less motor steps after each reversal, by the play, whatever the force.

Slow, the table rests on the flank that pushes it. Where the motor brakes harder than friction does the table,
the table flies on to the other flank (Nordin and Gutman 2002, section 2, without the contact's spring).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numba
import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

PLAYS_M = (2.5e-7, 5e-7, 1e-6, 2e-6, 3e-6, 5e-6, 8e-6, 1.2e-5, 1.8e-5, 2.5e-5)

LOOSE = (1.0, 1.5)
"""Mass that moves in all over that of the table, where the rotor's is not known."""
HELD = (math.inf, 0.0)
"""Of a table that does not fly."""


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    """Half of the play, and what brakes the flying table: m/s^2 of Coulomb and 1/s of viscous friction."""
    flights = [HELD, *_flights(scenes)]
    return [(play, *flight) for play in PLAYS_M for flight in flights]


def _flights(scenes: Sequence[Scene]) -> list[tuple[float, float]]:
    """By the friction and the mass that the model's forces tell."""
    columns = [(m.acceleration_m_s2, m.velocity_m_s, m.direction) for m in (s.motion for s in scenes)]
    force_n = np.concatenate([s.model_force_n for s in scenes])
    rigid = np.concatenate([np.stack(own, axis=1) for own in columns])
    found, *_ = np.linalg.lstsq(rigid, force_n, rcond=None)
    mass_kg, viscous_n_s_m, coulomb_n = (float(value) for value in found)
    motor_kg = scenes[0].motor_mass_kg
    lighter = [mass_kg / (mass_kg - motor_kg)] if 0.0 < motor_kg < mass_kg else LOOSE
    if min(mass_kg, coulomb_n) <= 0.0:
        return []
    return [(k * coulomb_n / mass_kg, k * max(viscous_n_s_m, 0.0) / mass_kg) for k in lighter]


@numba.njit(cache=True)
def _play(
    position_m: Array,
    velocity_m_s: Array,
    period_s: float,
    half_m: float,
    coulomb_m_s2: float,
    viscous_1_s: float,
) -> Array:
    """Table of a motor that moves like that with `half_m` of play to either side, less the motor."""
    less_motor_m = np.zeros(len(position_m))
    place_m, speed_m_s = position_m[0], 0.0
    for i in range(len(position_m)):
        lost_m_s = (coulomb_m_s2 + viscous_1_s * abs(speed_m_s)) * period_s
        speed_m_s = np.sign(speed_m_s) * max(abs(speed_m_s) - lost_m_s, 0.0)
        place_m += speed_m_s * period_s
        if place_m < position_m[i] - half_m:
            place_m, speed_m_s = position_m[i] - half_m, max(speed_m_s, velocity_m_s[i])
        elif place_m > position_m[i] + half_m:
            place_m, speed_m_s = position_m[i] + half_m, min(speed_m_s, velocity_m_s[i])
        less_motor_m[i] = place_m - position_m[i]
    return less_motor_m


def _columns(scene: Scene, shape: Shape) -> Array:
    m = scene.motion
    return (_play(m.position_m, m.velocity_m_s, scene.period_s, *shape) / shape[0])[:, None]


HYPOTHESES = [Hypothesis(Sense.DEVIATION, _shapes, _columns)]
EQUIVALENT = ()
SYSTEMATIC = {"play_m": (0.06, 0.6)}
"""Flanks give way by a law that nobody knows, and friction keeps the table from coming to rest on them: the
play is seen too small. So far in the trials' training seeds 308 to 436 and 100000 to 100399."""


def possible(coefficients: Array) -> bool:
    """No play is negative."""
    return bool(coefficients[0] > 0.0)


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Half of the total play, as in hil_sim."""
    return {"play_m": Parameter(float(coefficients[0]), "m")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the scale steps {2e6 * p['play_m']:.1f} um, the total play, after each reversal whatever "
        "the force: backlash; compliance would grow with force"
    )
