"""Backlash: scale less motor steps after each reversal, by the gap, whatever the force.

In slow motion the flank pushes the table. If the motor brakes harder than friction brakes the table,
the table moves freely to the other flank (Nordin and Gutman 2002, section 2, without the contact's spring).
"""

import math
from collections.abc import Sequence

import numpy as np

from hil_sim.physics.transmission import backlash as physics
from kernels.arrays import Array, compiled_layout
from kernels.jit import kernel
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, IndicatorKind, PlausibleTerm, Rival
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters, TermFamily

HALF_GAPS_M = (2.5e-7, 5e-7, 1e-6, 2e-6, 3e-6, 5e-6, 8e-6, 1.2e-5, 1.8e-5, 2.5e-5)
MASS_RATIOS = (1.0, 1.5)
"""Ratios of the total moved mass to the table's, tried if the rotor's mass is not known; chosen."""
STOPS_AT_ONCE = (math.inf, 0.0)
"""Deceleration (m/s^2, 1/s) of a table that friction stops at once."""
LEAST_STEP_RATIO = 0.5
"""Least step of the scale over the gap that the motor crosses: 1 of a play, more where the table flies."""
INDICATOR_HALF_GAP_M = 1e-6
"""Half gap of the indicator: small, so that backlash and wind-up count alike as lost motion."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Half of the gap m, and the deceleration of a free table: Coulomb m/s^2, viscous 1/s."""
    decelerations = [STOPS_AT_ONCE, *_decelerations(datasets)]
    return [(half, *deceleration) for half in HALF_GAPS_M for deceleration in decelerations]


def _decelerations(datasets: Sequence[RegressionData]) -> list[tuple[float, float]]:
    """Decelerations from the mass and friction that a rigid model fits to the model's forces."""
    columns = [(m.acceleration_m_s2, m.velocity_m_s, m.direction) for m in (data.motion for data in datasets)]
    force_n = np.concatenate([data.model_force_n for data in datasets])
    rigid = np.concatenate([np.stack(own, axis=1) for own in columns])
    theta, *_ = np.linalg.lstsq(rigid, force_n, rcond=None)
    mass_kg, viscous_n_s_m, coulomb_n = (float(value) for value in theta)
    motor_kg = datasets[0].motor_mass_kg
    lighter = [mass_kg / (mass_kg - motor_kg)] if 0.0 < motor_kg < mass_kg else MASS_RATIOS
    if min(mass_kg, coulomb_n) <= 0.0:
        return []
    return [(k * coulomb_n / mass_kg, k * max(viscous_n_s_m, 0.0) / mass_kg) for k in lighter]


@kernel
def _free_table(
    position_m: Array,
    velocity_m_s: Array,
    period_s: float,
    half_m: float,
    coulomb_m_s2: float,
    viscous_1_s: float,
) -> Array:
    """Return the position of the table less that of the motor, m (n,); the gap is `half_m` to either side."""
    less_motor_m = np.zeros(len(position_m))
    table_m, speed_m_s = position_m[0], 0.0
    for i in range(len(position_m)):
        lost_m_s = (coulomb_m_s2 + viscous_1_s * abs(speed_m_s)) * period_s
        speed_m_s = np.sign(speed_m_s) * max(abs(speed_m_s) - lost_m_s, 0.0)
        table_m += speed_m_s * period_s
        if table_m < position_m[i] - half_m:
            table_m, speed_m_s = position_m[i] - half_m, max(speed_m_s, velocity_m_s[i])
        elif table_m > position_m[i] + half_m:
            table_m, speed_m_s = position_m[i] + half_m, min(speed_m_s, velocity_m_s[i])
        less_motor_m[i] = table_m - position_m[i]
    return less_motor_m


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    m = data.motion
    less_motor_m = _free_table(compiled_layout(m.position_m), m.velocity_m_s, data.period_s, *shape)
    return (less_motor_m / shape[0])[:, None]


def _yields(found: IdentifiedTerms) -> str:
    """Return why this is no play: what builds up over a longer way than its height is elastic."""
    ratio = found.terms[0]["play_m"] / found.shapes[0][0]
    if ratio >= LEAST_STEP_RATIO:
        return ""
    return f"the scale steps by {100.0 * ratio:.2g} % of what the motor crosses: that yields, and has no play"


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """All of the friction decelerates the free table, as in the plant."""
    play_m, base = of.params.play_m, of.base
    table_kg = base["mass_kg"] - of.axis.motor_mass_kg
    brakes = base["coulomb_n"] / table_kg, base["viscous_n_s_m"] / table_kg
    term = ModelTerm(of.effect, (play_m, *brakes), (play_m,), ResidualChannel.POSITION_DEVIATION)
    return [term] if play_m > 0.0 else []


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes, ResidualChannel.POSITION_DEVIATION),),
    coefficients={"play_m": "m"},  # half of the gap, as in hil_sim
    sentence=lambda p: (
        f"the scale steps {2e6 * p['play_m']:.1f} um, the total play, after each reversal whatever "
        "the force: backlash; compliance would grow with force"
    ),
    physical=POSITIVE,
    refused=_yields,
    continuous_shape_parameters=2,
    # The flanks' stiffness is not known, and friction holds the table off them: the estimate is too small.
    # Calibrated on the blind trials' seeds 308 to 436 and 100000 to 100399.
    systematic={"play_m": (0.06, 0.6)},
    indicators=(
        IndicatorKind(
            name="lost_motion_m",
            unit="m",
            words="lost motion at a reversal",
            shape_parameters=(INDICATOR_HALF_GAP_M, *STOPS_AT_ONCE),
            factor=2.0,
            beside=True,
        ),
    ),
    from_plant=_from_plant,
    rivals=(
        Rival("presliding_hysteresis"),
        Rival(
            "drive_compliance",
            "a play is a step of one height; a compliance moves in proportion to the force",
        ),
        Rival("lead_error_periodic"),
    ),
    shown_by="the scale steps by the same at every reversal, whatever the force",
    experiment="scale",
    plausible=lambda _sizes: [PlausibleTerm((2e-6, *STOPS_AT_ONCE), (2e-6,))],
    rank=17,
)
