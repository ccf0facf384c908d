"""Decides a verdict again from its evidence, under other thresholds, widths, calibration and ranking.

It repeats the decisions of `reconcile` after its search: which findings are reported, their confidence,
intervals and order, and whether the unexplained residual is an unknown. Rules can only be stricter on names
than the engine that was run: an effect that it did not find is not in the evidence.
"""

import math
from typing import Any, NamedTuple

Row = dict[str, Any]
GAIN_MARGIN = 0.005
"""Distance from 0 and 1 to which gains are clipped: log odds are finite."""
ON_EVERY_AXIS = ("presliding_hysteresis", "cogging")
"""Ranked lower, as by the engine."""
UNEXPLAINED = "unexplained"
"""`over` of an unknown that is the unexplained residual, and no term."""


class Rules(NamedTuple):
    """Constants that are fitted on training cases."""

    intercept: float = 3.1
    slope: float = 0.8
    """Log odds of a true name over those of its held-out gain, without a rival."""
    least_gain: float = 0.1
    """Least share of the unexplained held-out variance of a reported name."""
    least_confidence: float = 0.4
    least_size: float = 0.0
    """Least RMS of a named effect over that of the rigid model's residual."""
    least_roundings: float = 1.0
    """Least RMS of an effect between motor and scale over the rounding of both."""
    width: float = 1.0
    """Factor on half the width of an interval."""
    common_ratio: float = 4.0
    """Divisor of the share of an effect that every axis has, for the ranking."""
    floors: float = 3.0
    left_share: float = 0.25
    """Least unexplained force of an unknown: RMS in noise floors, and share of the rigid model's squares."""
    far_floors: float = 20.0
    far_share: float = 0.05
    """The same of a far larger one."""
    strength: float = 25.0
    """Least RMS in noise floors times the root of the Ljung-Box statistic a lag."""


def decided(evidence: Row, rules: Rules) -> Row:
    """Return a verdict with `verdict`, `findings` and `accounted` under these rules."""
    named = [one for one in evidence["findings"] if one["effect"] != "unknown"]
    recalibrated = [
        one | {"confidence": confidence(one, rules), "parameters": widened(one["parameters"], rules.width)}
        for one in named
    ]
    reported = sorted(
        (one for one in recalibrated if _is_reported(one, evidence, rules)),
        key=lambda one: _place(one, rules),
    )
    unknown = [
        one for one in evidence["findings"] if one["effect"] == "unknown" and one.get("over") != UNEXPLAINED
    ]
    if not unknown and is_unexplained(evidence, rules):
        unknown = [
            {"effect": "unknown", "confidence": 0.5, "equivalent": [], "parameters": {}, "over": UNEXPLAINED}
        ]
    word = evidence["verdict"]
    if reported or unknown:
        word = "effects" if reported else "unknown"
    elif word not in {"parameters", "consistent"}:
        word = "consistent"
    return {"verdict": word, "findings": [*reported, *unknown], "accounted": evidence["accounted"]}


def confidence(finding: Row, rules: Rules) -> float:
    """Return the probability that a name is true."""
    gain = min(max(finding["heldout_gain"], GAIN_MARGIN), 1.0 - GAIN_MARGIN)
    odds = rules.intercept + rules.slope * math.log(gain / (1.0 - gain))
    return float((1.0 - finding["best_rival"]) / (1.0 + math.exp(-odds)))


def widened(parameters: Row, factor: float) -> Row:
    """Return the parameters with intervals of another width about their values."""
    return {
        name: of
        | {
            "ci95": [
                of["value"] + factor * (of["ci95"][0] - of["value"]),
                of["value"] + factor * (of["ci95"][1] - of["value"]),
            ]
        }
        for name, of in parameters.items()
    }


def is_unexplained(evidence: Row, rules: Rules) -> bool:
    """Return whether the residual of the force is more than noise and the misfit of named effects."""
    for axis, channels in evidence["accounted"].items():
        of, left = channels["force"], channels["force"]["left"]
        noise = of["parts"]["noise"]["rms"]
        refitted = evidence["fit"][axis]["force"]["refitted"]["train"]
        constant = of["parts"].get("constant_force", {"rms": 0.0})["rms"]
        varying_squares = max(refitted**2 - constant**2, 0.0)
        is_large = any(
            left >= floors * noise and left**2 >= share * varying_squares
            for floors, share in ((rules.floors, rules.left_share), (rules.far_floors, rules.far_share))
        )
        strength = left * math.sqrt(evidence["colour"][axis]["force"])
        if is_large and left >= of["matters"] and strength >= rules.strength * noise:
            return True
    return False


def _is_reported(finding: Row, evidence: Row, rules: Rules) -> bool:
    axis, channel = finding["axis"], finding["sensor"]
    of = evidence["accounted"][axis][channel]
    size = of["parts"].get(finding["effect"], {"rms": math.inf})["rms"]
    refitted = evidence["fit"][axis][channel]["refitted"]["train"]
    return bool(
        finding["heldout_gain"] >= rules.least_gain
        and finding["confidence"] >= rules.least_confidence
        and size >= rules.least_size * refitted
        and (channel == "force" or size >= rules.least_roundings * of["matters"])
    )


def _place(finding: Row, rules: Rules) -> float:
    ratio = rules.common_ratio if finding["effect"] in ON_EVERY_AXIS else 1.0
    return float(-finding["share"] / ratio)
