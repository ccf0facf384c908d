"""What a tilting axis may conceal: each with its size drawn for the machine, and its truth."""

import math

import numpy as np

from tests.campaigns.blind.families.interface import Effect
from tests.campaigns.blind.families.tilting_table.trunnion import Trunnion

CONFLICTS = [
    frozenset({"gravity", "constant_force"}),
    frozenset({"gravity", "position_dependent_friction"}),
    frozenset({"constant_force", "asymmetric_coulomb_friction"}),
    frozenset({"cogging", "torque_ripple"}),
    frozenset({"current_loop_lag", "transport_delay"}),
]
RECORDS_ASKED = frozenset({"transport_delay", "current_loop_lag"})
"""Seen only where the recording holds the torque that was asked, not that of the current."""
AT_THE_TABLE = frozenset({"backlash", "lead_error_cumulative", "encoder_eccentricity"})
"""Seen only by an encoder at the table."""
STANDARD_GRAVITY_M_S2 = 9.80665


def choices(
    m: Trunnion, rng: np.random.Generator, low: float, high: float, fast: float, speed_hz: float
) -> dict[str, tuple[dict[str, float], Effect]]:
    """Return by name the fields of the axis that the effect changes, and what is true of it.

    Args:
        m: the axis without concealed effects.
        rng: draws the sizes.
        low: least angle of the travel, rad.
        high: largest angle of the travel, rad.
        fast: top speed, rad/s.
        speed_hz: bandwidth of the speed loop: what is late stays well below its period.
    """
    dry = m.worm_dry + m.seal_dry
    span = high - low

    def some(least: float, most: float) -> float:
        return float(rng.uniform(least, most))

    def sized(least: float, most: float) -> float:
        return least * (most / least) ** float(rng.random())

    def either(least: float, most: float) -> float:
        return sized(least, most) * float(rng.choice([-1.0, 1.0]))

    # a workpiece of 40 to 200 kg, clamped 20 to 150 mm beside the axis
    weight = max(some(40.0, 200.0) * some(0.02, 0.15) * STANDARD_GRAVITY_M_S2, 0.4 * dry)
    push, favour = either(0.2, 1.0) * dry, either(0.08, 0.35) * dry
    drag = either(0.15, 0.45) * m.worm_viscous
    churning = sized(0.3, 1.5) * dry / fast**2
    pump, hertz = sized(0.06, 0.4) * dry, sized(2.5, 25.0)
    poles = float(rng.choice([1, 2, 6, 12]))
    detent, ripple = sized(0.08, 0.4) * dry, sized(0.02, 0.12)
    late_s = min(sized(0.0015, 0.008), 0.09 / speed_hz)
    lag_s = min(sized(0.0015, 0.006), 0.09 / speed_hz)
    play, disc = sized(6e-5, 5e-4), sized(2e-5, 1.5e-4)
    brake = {"brake": sized(0.15, 1.0) * dry, "brake_rad": some(low, high)}
    stribeck = {"mixed": sized(0.25, 1.1) * dry, "mixed_rad_s": fast * sized(0.012, 0.12)}
    made: dict[str, tuple[dict[str, float], dict[str, float]]] = {
        "gravity": ({"unbalance": weight, "unbalance_rad": some(0.0, 2.0 * math.pi)}, {"amplitude": weight}),
        "constant_force": ({"balancer": push}, {"force_n": push}),
        "asymmetric_coulomb_friction": ({"flank": favour}, {"force_n": -favour}),
        "asymmetric_viscous_friction": ({"flank_viscous": drag}, {"half_difference_n_s_m": drag}),
        "quadratic_viscous_friction": ({"churning": churning}, {"quadratic_n_s2_m2": churning}),
        "stribeck_friction": (stribeck, {}),
        "temperature_dependent_friction": ({"oil": sized(0.4, 1.6)}, {}),
        "position_dependent_friction": (brake | {"brake_width_rad": some(0.12, 0.35) * span}, {}),
        "presliding_hysteresis": ({"yield_rad": m.yield_rad * sized(12.0, 60.0)}, {}),
        "periodic_disturbance": (
            {"pump": pump, "pump_hz": hertz},
            {"amplitude": pump, "frequency_hz": hertz},
        ),
        "cogging": ({"detent": detent, "poles": poles}, {"amplitude": detent, "harmonic": poles}),
        "torque_ripple": ({"ripple": ripple, "poles": poles}, {"amplitude": ripple, "harmonic": poles}),
        "transport_delay": ({"late_s": late_s}, {"time_s": late_s}),
        "current_loop_lag": ({"lag_s": lag_s}, {"time_s": lag_s}),
        "backlash": ({"play_rad": play}, {"gap_rad": play}),
        "lead_error_cumulative": ({"pitch": either(5e-5, 6e-4)}, {}),
        "encoder_eccentricity": ({"disc_rad": disc}, {"amplitude": disc, "harmonic": 1.0}),
    }
    # the mesh rubs by the weight that it carries, and over a short travel a sine has a mean
    also = {"gravity": ("constant_force", "position_dependent_friction")}
    alike = {
        "constant_force": ("asymmetric_coulomb_friction",),
        "asymmetric_coulomb_friction": ("constant_force",),
        "encoder_eccentricity": ("lead_error_periodic",),
    }
    return {
        name: (
            fields,
            Effect(
                name,
                known,
                "deviation" if name in AT_THE_TABLE else "force",
                also.get(name, ()),
                alike.get(name, ()),
            ),
        )
        for name, (fields, known) in made.items()
    }
