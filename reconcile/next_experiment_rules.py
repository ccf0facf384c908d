"""By what two effects are told apart, in words, from the confusions that the literature knows."""

from __future__ import annotations

TOLD_APART = {
    (
        "asymmetric_coulomb_friction",
        "constant_force",
    ): "a constant force makes the breakaway easier one way by what it makes it harder the other way",
    (
        "asymmetric_viscous_friction",
        "asymmetric_coulomb_friction",
    ): "the difference between the directions grows with the speed only if it is viscous",
    (
        "asymmetric_viscous_friction",
        "constant_force",
    ): "the difference between the directions grows with the speed only if it is viscous",
    (
        "stribeck_friction",
        "presliding_hysteresis",
    ): "a Stribeck rise stays at constant speed; presliding is over after its way",
    (
        "stribeck_friction",
        "quadratic_viscous_friction",
    ): "a Stribeck rise is gone at a few times its speed, a square goes on growing",
    (
        "stribeck_friction",
        "dwell_dependent_breakaway",
    ): "only a breakaway that ages grows with the rest before it",
    (
        "quadratic_viscous_friction",
        "torque_constant_saturation",
    ): "at constant speed the force is small: what grows with the speed is friction",
    (
        "quadratic_viscous_friction",
        "voltage_saturation",
    ): "at constant speed the force is small: what grows with the speed is friction",
    (
        "presliding_hysteresis",
        "backlash",
    ): "within its play the scale stands still; presliding lets it follow against a force",
    ("presliding_hysteresis", "dwell_dependent_breakaway"): "presliding is the same after any rest",
    (
        "presliding_hysteresis",
        "current_loop_lag",
    ): "presliding goes by the way since the reversal, a lag by the time",
    (
        "presliding_hysteresis",
        "transport_delay",
    ): "presliding goes by the way since the reversal, a delay by the time",
    ("presliding_hysteresis", "torque_ripple"): "over strokes far below a turn there is no ripple",
    (
        "dwell_dependent_breakaway",
        "temperature_dependent_friction",
    ): "in mixed order, what grows with the rest is no drift",
    (
        "position_dependent_friction",
        "position_dependent_force",
    ): "over the same places both ways, friction changes its sign with the direction",
    (
        "position_dependent_friction",
        "temperature_dependent_friction",
    ): "a place keeps its friction when the axis is warm",
    ("position_dependent_force", "constant_force"): "at several places a constant force is the same",
    (
        "backlash",
        "drive_compliance",
    ): "a play is a step of one height; a compliance moves in proportion to the force",
    (
        "drive_compliance",
        "current_loop_lag",
    ): "a compliance shows on the scale and resonates; a lag stays in the force",
    (
        "drive_compliance",
        "transport_delay",
    ): "a compliance grows with the square of the frequency, a delay in proportion to it",
    ("lead_error_cumulative", "thermal_expansion"): "a lead error is there from the start",
    (
        "lead_error_periodic",
        "encoder_eccentricity",
    ): "the table itself swings once a turn only if it is the screw",
    ("lead_error_periodic", "backlash"): "a play steps wherever the motion turns",
    (
        "lead_error_periodic",
        "scale_cyclic_error",
    ): "evenly over several turns each pitch repeats as often as it must",
    (
        "cogging",
        "torque_ripple",
    ): "over the same places a torque ripple grows with the current, cogging does not",
    (
        "cogging",
        "periodic_disturbance",
    ): "cogging changes its frequency with the speed, a disturbance from outside does not",
    (
        "torque_ripple",
        "periodic_disturbance",
    ): "a ripple changes its frequency with the speed, a disturbance from outside does not",
    (
        "cogging",
        "scale_cyclic_error",
    ): "the force that a scale's error causes grows with the square of the speed",
    ("cogging", "position_dependent_force"): "over several turns cogging repeats",
    (
        "cogging",
        "position_dependent_friction",
    ): "over the same places both ways, cogging keeps its sign and friction does not",
    (
        "torque_constant_saturation",
        "voltage_saturation",
    ): "a torque constant is lost at low speed too, voltage only at high speed",
    ("torque_constant_saturation", "payload_mass"): "a known mass shows what a newton of the drive is worth",
    (
        "current_loop_lag",
        "transport_delay",
    ): "a delay turns the phase in proportion to the frequency, a lag of first order ever less",
    (
        "amplifier_dead_zone",
        "asymmetric_coulomb_friction",
    ): "a dead zone shows where the force is zero, friction where the speed is",
    (
        "amplifier_dead_zone",
        "stribeck_friction",
    ): "a dead zone shows where the force is zero, friction where the speed is",
    (
        "amplifier_dead_zone",
        "presliding_hysteresis",
    ): "a dead zone shows where the force is zero, presliding where the motion turns",
}
"""By pair of effects; of each the first is more often found."""

SHOWN_BY = {
    "asymmetric_viscous_friction": "the directions differ more at higher speed",
    "stribeck_friction": "friction rises towards standstill at constant speeds too",
    "quadratic_viscous_friction": "friction grows with the square of the speed",
    "presliding_hysteresis": "the force turns over a way, however slow the reversal",
    "dwell_dependent_breakaway": "the first peak grows with the rest before it",
    "position_dependent_friction": "what changes with the place changes sign with direction",
    "temperature_dependent_friction": "friction falls with warmth, and comes back",
    "backlash": "the scale steps by the same at every reversal, whatever the force",
    "drive_compliance": "the scale lags in proportion to the force",
    "lead_error_cumulative": "it is there from the start",
    "lead_error_periodic": "it repeats once a turn at any speed",
    "thermal_expansion": "the scale drifts in proportion to the position",
    "cogging": "it stays at its places at any speed",
    "torque_ripple": "it grows with the current",
    "torque_constant_saturation": "force is lost at its peaks, at any speed",
    "current_loop_lag": "what is left follows the rate of the force",
    "amplifier_dead_zone": "it shows where the force is zero",
    "transport_delay": "what is left follows the jerk",
    "scale_cyclic_error": "in the force it grows with the square of the speed",
    "constant_force": "the breakaway differs by direction, by the same everywhere",
    "position_dependent_force": "over the same places it does not ask for the direction",
    "periodic_disturbance": "its frequency stays at any speed",
    "payload_mass": "a known mass shows what a newton of the drive is worth",
    "cross_axis_coupling": "it follows the other axis, even while this one stands",
    "voltage_saturation": "force is missing only at high speed",
}
"""By effect: what shows it, whatever the rival."""

TAKES_MORE = {
    ("asymmetric_coulomb_friction", "constant_force"): "breakaway",
    ("lead_error_periodic", "encoder_eccentricity"): "third sensor",
    ("lead_error_cumulative", "thermal_expansion"): "warm",
    ("position_dependent_friction", "temperature_dependent_friction"): "warm",
    ("torque_constant_saturation", "payload_mass"): "added mass",
}
"""By pair: of `next_experiment_by_hand.EXPERIMENTS`, where no motion tells by itself."""


def told_apart(one: str, other: str) -> str:
    """What tells two effects apart; empty where nothing is known of either."""
    pair = TOLD_APART.get((one, other)) or TOLD_APART.get((other, one))
    return pair or SHOWN_BY.get(one) or SHOWN_BY.get(other) or ""


def takes_more(one: str, other: str) -> str:
    """The experiment that needs more than a motion; empty where there is none."""
    return TAKES_MORE.get((one, other)) or TAKES_MORE.get((other, one)) or ""


def confused_with(effect: str) -> list[str]:
    """What an effect is often mistaken for."""
    pairs = [pair for pair in TOLD_APART if effect in pair]
    return [pair[1] if pair[0] == effect else pair[0] for pair in pairs]
