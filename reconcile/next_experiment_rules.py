"""Which experiment tells two effects apart, and by what; from the confusions that the literature knows."""

from __future__ import annotations

from typing import NamedTuple


class Rule(NamedTuple):
    """What to do about a doubt."""

    experiment: str
    """Of `next_experiment_motions.EXPERIMENTS`."""
    tells: str
    """What to look for."""


TOLD_APART = {
    ("asymmetric_coulomb_friction", "constant_force"): Rule(
        "breakaway",
        "a constant force makes the breakaway easier one way by what it makes it harder the other way",
    ),
    ("asymmetric_viscous_friction", "asymmetric_coulomb_friction"): Rule(
        "speeds", "the difference between the directions grows with the speed only if it is viscous"
    ),
    ("asymmetric_viscous_friction", "constant_force"): Rule(
        "speeds", "the difference between the directions grows with the speed only if it is viscous"
    ),
    ("stribeck_friction", "presliding_hysteresis"): Rule(
        "slow speeds", "a Stribeck rise stays at constant speed; presliding is over after its way"
    ),
    ("stribeck_friction", "quadratic_viscous_friction"): Rule(
        "slow speeds", "a Stribeck rise is gone at a few times its speed, a square goes on growing"
    ),
    ("stribeck_friction", "dwell_dependent_breakaway"): Rule(
        "dwells", "only a breakaway that ages grows with the rest before it"
    ),
    ("quadratic_viscous_friction", "torque_constant_saturation"): Rule(
        "speeds", "at constant speed the force is small: what grows with the speed is friction"
    ),
    ("quadratic_viscous_friction", "voltage_saturation"): Rule(
        "speeds", "at constant speed the force is small: what grows with the speed is friction"
    ),
    ("presliding_hysteresis", "backlash"): Rule(
        "small strokes", "within its play the scale stands still; presliding lets it follow against a force"
    ),
    ("presliding_hysteresis", "dwell_dependent_breakaway"): Rule(
        "dwells", "presliding is the same after any rest"
    ),
    ("presliding_hysteresis", "current_loop_lag"): Rule(
        "small strokes", "presliding goes by the way since the reversal, a lag by the time"
    ),
    ("presliding_hysteresis", "transport_delay"): Rule(
        "small strokes", "presliding goes by the way since the reversal, a delay by the time"
    ),
    ("presliding_hysteresis", "torque_ripple"): Rule(
        "small strokes", "over strokes far below a turn there is no ripple"
    ),
    ("dwell_dependent_breakaway", "temperature_dependent_friction"): Rule(
        "dwells", "in mixed order, what grows with the rest is no drift"
    ),
    ("position_dependent_friction", "position_dependent_force"): Rule(
        "speeds", "over the same places both ways, friction changes its sign with the direction"
    ),
    ("position_dependent_friction", "temperature_dependent_friction"): Rule(
        "warm", "a place keeps its friction when the axis is warm"
    ),
    ("position_dependent_force", "constant_force"): Rule(
        "breakaway", "at several places a constant force is the same"
    ),
    ("backlash", "drive_compliance"): Rule(
        "reversals", "a play is a step of one height; a compliance moves in proportion to the force"
    ),
    ("drive_compliance", "current_loop_lag"): Rule(
        "edges", "a compliance shows on the scale and resonates; a lag stays in the force"
    ),
    ("drive_compliance", "transport_delay"): Rule(
        "edges", "a compliance grows with the square of the frequency, a delay in proportion to it"
    ),
    ("lead_error_cumulative", "thermal_expansion"): Rule("warm", "a lead error is there from the start"),
    ("lead_error_periodic", "encoder_eccentricity"): Rule(
        "third sensor", "the table itself swings once a turn only if it is the screw"
    ),
    ("lead_error_periodic", "backlash"): Rule("reversals", "a play steps wherever the motion turns"),
    ("lead_error_periodic", "scale_cyclic_error"): Rule(
        "speeds", "evenly over several turns each pitch repeats as often as it must"
    ),
    ("cogging", "torque_ripple"): Rule(
        "accelerations", "over the same places a torque ripple grows with the current, cogging does not"
    ),
    ("cogging", "periodic_disturbance"): Rule(
        "speeds", "cogging changes its frequency with the speed, a disturbance from outside does not"
    ),
    ("torque_ripple", "periodic_disturbance"): Rule(
        "speeds", "a ripple changes its frequency with the speed, a disturbance from outside does not"
    ),
    ("cogging", "scale_cyclic_error"): Rule(
        "speeds", "the force that a scale's error causes grows with the square of the speed"
    ),
    ("cogging", "position_dependent_force"): Rule("speeds", "over several turns cogging repeats"),
    ("cogging", "position_dependent_friction"): Rule(
        "speeds", "over the same places both ways, cogging keeps its sign and friction does not"
    ),
    ("torque_constant_saturation", "voltage_saturation"): Rule(
        "fast and hard", "a torque constant is lost at low speed too, voltage only at high speed"
    ),
    ("torque_constant_saturation", "payload_mass"): Rule(
        "added mass", "a known mass shows what a newton of the drive is worth"
    ),
    ("current_loop_lag", "transport_delay"): Rule(
        "edges", "a delay turns the phase in proportion to the frequency, a lag of first order ever less"
    ),
    ("amplifier_dead_zone", "asymmetric_coulomb_friction"): Rule(
        "zero force", "a dead zone shows where the force is zero, friction where the speed is"
    ),
    ("amplifier_dead_zone", "stribeck_friction"): Rule(
        "zero force", "a dead zone shows where the force is zero, friction where the speed is"
    ),
    ("amplifier_dead_zone", "presliding_hysteresis"): Rule(
        "zero force", "a dead zone shows where the force is zero, presliding where the motion turns"
    ),
}
"""By pair of effects; of each the first is more often found."""

SHOWN_BY = {
    "asymmetric_viscous_friction": Rule("speeds", "the directions differ more at higher speed"),
    "stribeck_friction": Rule("slow speeds", "friction rises towards standstill at constant speeds too"),
    "quadratic_viscous_friction": Rule("speeds", "friction grows with the square of the speed"),
    "presliding_hysteresis": Rule("small strokes", "the force turns over a way, however slow the reversal"),
    "dwell_dependent_breakaway": Rule("dwells", "the first peak grows with the rest before it"),
    "position_dependent_friction": Rule("speeds", "what changes with the place changes sign with direction"),
    "temperature_dependent_friction": Rule("warm", "friction falls with warmth, and comes back"),
    "backlash": Rule("reversals", "the scale steps by the same at every reversal, whatever the force"),
    "drive_compliance": Rule("reversals", "the scale lags in proportion to the force"),
    "lead_error_cumulative": Rule("warm", "it is there from the start"),
    "lead_error_periodic": Rule("speeds", "it repeats once a turn at any speed"),
    "thermal_expansion": Rule("warm", "the scale drifts in proportion to the position"),
    "cogging": Rule("speeds", "it stays at its places at any speed"),
    "torque_ripple": Rule("accelerations", "it grows with the current"),
    "torque_constant_saturation": Rule("accelerations", "force is lost at its peaks, at any speed"),
    "current_loop_lag": Rule("edges", "what is left follows the rate of the force"),
    "amplifier_dead_zone": Rule("zero force", "it shows where the force is zero"),
    "transport_delay": Rule("edges", "what is left follows the jerk"),
    "scale_cyclic_error": Rule("speeds", "in the force it grows with the square of the speed"),
    "constant_force": Rule("breakaway", "the breakaway differs by direction, by the same everywhere"),
    "position_dependent_force": Rule("speeds", "over the same places it does not ask for the direction"),
    "periodic_disturbance": Rule("speeds", "its frequency stays at any speed"),
    "payload_mass": Rule("added mass", "a known mass shows what a newton of the drive is worth"),
    "cross_axis_coupling": Rule("one by one", "it follows the other axis, even while this one stands"),
    "voltage_saturation": Rule("fast and hard", "force is missing only at high speed"),
}
"""By effect: what shows it best, whatever the rival."""

LIVES_OVER = {
    "run_time": "warm",
    "run_time_by_direction": "warm",
    "run_time_of_the_mass": "warm",
    "position": "speeds",
    "position_by_direction": "speeds",
    "velocity": "speeds",
    "speed_by_direction": "slow speeds",
    "acceleration": "accelerations",
    "force": "accelerations",
    "distance_since_reversal": "small strokes",
}
"""By the coordinate of what no entry explains: the experiment that varies it alone."""

HIDDEN = {
    "speeds": ("quadratic_viscous_friction", "asymmetric_viscous_friction"),
    "slow speeds": ("stribeck_friction", "presliding_hysteresis"),
    "small strokes": ("presliding_hysteresis", "backlash"),
    "breakaway": ("constant_force", "asymmetric_coulomb_friction"),
    "dwells": ("dwell_dependent_breakaway", "stribeck_friction"),
    "accelerations": ("torque_ripple", "torque_constant_saturation"),
    "fast and hard": ("voltage_saturation", "torque_constant_saturation"),
    "zero force": ("amplifier_dead_zone", "stribeck_friction"),
    "one by one": ("cross_axis_coupling", "position_dependent_force"),
    "warm": ("temperature_dependent_friction", "thermal_expansion"),
    "scale": ("backlash", "drive_compliance"),
}
"""By experiment that was never made: what would not have shown; the most likely first."""


def told_apart(one: str, other: str) -> Rule | None:
    """What tells two effects apart; None where nothing is known of either."""
    rule = TOLD_APART.get((one, other)) or TOLD_APART.get((other, one))
    return rule or SHOWN_BY.get(one) or SHOWN_BY.get(other)
