"""The rows of the table of a fleet: one for each axis, diagnosed or not."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from reconcile.fleet.dataset import AxisData

Row = dict[str, Any]
"""Keys are the names of COLUMNS."""

CHANNEL_UNITS = {"force": "n", "deviation": "m"}
LEVELS = ("before", "refitted", "after")
TRANSIENT = ("killed", "over time", "failed", "unreadable", "no model")
"""Failures that a repetition may remedy without another recording; `unusable` recordings stay unusable."""

PARAMETER = {"name": "string", "value": "double", "low": "double", "high": "double", "unit": "string"}
EFFECT = {
    "effect": "string",
    "sense": "string",
    "confidence": "double",
    "equivalent": ["string"],
    "heldout_gain": "double",
    "parameters": [PARAMETER],
}
COLUMNS: dict[str, Any] = {
    "machine": "string",
    "axis": "string",
    "status": "string",
    "verdict": "string",
    "effects": [EFFECT],
    "minor": ["string"],
    **{f"{channel}_{level}_{unit}": "double" for channel, unit in CHANNEL_UNITS.items() for level in LEVELS},
    "recordings": "int32",
    "bytes": "int64",
    "bad_files": [{"file": "string", "reason": "string"}],
    "error": "string",
    "seconds": "double",
    "model": "string",
    "key": "string",
}
"""Types by column, for `write_records`. `status`: diagnosed, or why not; levels: RMS on held-out blocks; low
and high: bounds of the 95 % interval.
"""


def row_of_verdict(
    data: AxisData, key: str, verdict: Mapping[str, Any], bad: Sequence[Mapping[str, str]], *, recordings: int
) -> Row:
    """Return the row of a diagnosed axis from its verdict.json; `bad` lists the excluded files."""
    fit = verdict["fit"].get(data.axis, {})
    levels = {
        f"{channel}_{level}_{unit}": _number(fit[channel][level]["heldout"])
        for channel, unit in CHANNEL_UNITS.items()
        if channel in fit
        for level in LEVELS
    }
    return {
        **_empty(data, key),
        **levels,
        "status": "diagnosed",
        "verdict": verdict["verdict"],
        "effects": [_effect(one) for one in verdict["findings"] if one["axis"] == data.axis],
        "minor": [one["effect"] for one in verdict["minor"] if one["axis"] == data.axis],
        "recordings": recordings,
        "bad_files": [dict(one) for one in bad],
    }


def row_of_failure(data: AxisData, key: str, status: str, reason: str) -> Row:
    """Return the row of an axis that could not be diagnosed."""
    return {**_empty(data, key), "status": status, "error": reason}


def _empty(data: AxisData, key: str) -> Row:
    own = {"machine": data.machine, "axis": data.axis, "key": key, "bytes": data.bytes, "seconds": 0.0}
    lists: Row = {"effects": [], "minor": [], "bad_files": [], "recordings": 0}
    return dict.fromkeys(COLUMNS) | lists | own


def _effect(finding: Mapping[str, Any]) -> Row:
    return {
        "effect": finding["effect"],
        "sense": finding["where"]["sensor"],
        "confidence": _number(finding["confidence"]),
        "equivalent": list(finding["equivalent"]),
        "heldout_gain": _number(finding["heldout_gain"]),
        "parameters": [
            {
                "name": name,
                "value": _number(one["value"]),
                "low": _number(one["ci95"][0]),
                "high": _number(one["ci95"][1]),
                "unit": one["unit"],
            }
            for name, one in finding["parameters"].items()
        ],
    }


def _number(value: Any) -> float | None:
    """Return None for NaN and infinity, which JSON cannot hold."""
    return float(value) if value is not None and math.isfinite(value) else None
