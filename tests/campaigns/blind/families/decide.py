"""Decide a verdict anew from its evidence, under other thresholds, widths, calibration and ranking.

What `reconcile` decides behind its search is remade here without it: which findings are large and sure enough
to be said, how sure each is, how wide its intervals are, in which order they come, and whether what is left
is called unknown. Rules can only be stricter on names than the engine that was run: what it did not find is
not in the evidence. On what is left they are free.
"""

import math
from typing import Any, NamedTuple

Row = dict[str, Any]
GAIN_MARGIN = 0.005
"""Distance from 0 and 1 to which gains are clipped: log odds are finite."""
ON_EVERY_AXIS = ("presliding_hysteresis", "cogging")
"""Ranked lower, as by the engine."""
REST = "unexplained"
"""`over` of an unknown that is what is left, and no term."""


class Rules(NamedTuple):
    """Constants that are fitted on training cases."""

    intercept: float = 3.1
    slope: float = 0.8
    """Log odds of a true name over those of its held-out gain; no rival may predict better beside."""
    least_gain: float = 0.1
    """Share of the unexplained held-out variance below which a name is not said."""
    least_confidence: float = 0.4
    least_size: float = 0.0
    """RMS of a named effect over that of what a rigid model leaves of its channel."""
    least_roundings: float = 1.0
    """RMS of an effect between motor and scale over the rounding of the two."""
    width: float = 1.0
    """Factor on half the width of an interval."""
    common_ratio: float = 4.0
    """What every axis has is ranked as if its share were so much smaller."""
    floors: float = 3.0
    left_share: float = 0.25
    colour: float = 40.0
    far_floors: float = 20.0
    """Unknown is the force of which at least so many noise floors are left, this share of the squares that a
    rigid model leaves, and a Ljung-Box statistic of so much a lag or so many floors that no colour counts.
    The last was made of a look at the 300 cases before the published ones."""


def decided(evidence: Row, rules: Rules) -> Row:
    """Return a verdict with `verdict`, `findings` and `accounted` under these rules."""
    named = [one for one in evidence["findings"] if one["effect"] != "unknown"]
    surer = [
        one
        | {
            "confidence": confidence(one, rules),
            "parameters": widened(one["parameters"], rules.width),
        }
        for one in named
    ]
    said = sorted(
        (one for one in surer if _is_said(one, evidence, rules)), key=lambda one: _place(one, rules)
    )
    unknown = [one for one in evidence["findings"] if one["effect"] == "unknown" and one.get("over") != REST]
    if not unknown and is_left(evidence, rules):
        unknown = [{"effect": "unknown", "confidence": 0.5, "equivalent": [], "parameters": {}, "over": REST}]
    word = evidence["verdict"]
    if said or unknown:
        word = "effects" if said else "unknown"
    elif word not in {"parameters", "consistent"}:
        word = "consistent"
    return {"verdict": word, "findings": [*said, *unknown], "accounted": evidence["accounted"]}


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


def is_left(evidence: Row, rules: Rules) -> bool:
    """Return whether what is left of the force is more than noise and the misfit of what was named."""
    for axis, channels in evidence["accounted"].items():
        of, left = channels["force"], channels["force"]["left"]
        noise = of["parts"]["noise"]["rms"]
        refitted = evidence["fit"][axis]["force"]["refitted"]["train"]
        if (
            left >= max(rules.floors * noise, of["matters"])
            and left**2 >= rules.left_share * refitted**2
            and (evidence["colour"][axis]["force"] >= rules.colour or left >= rules.far_floors * noise)
        ):
            return True
    return False


def _is_said(finding: Row, evidence: Row, rules: Rules) -> bool:
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
