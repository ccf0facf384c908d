"""The rows of a fleet's table: one for each axis, diagnosed or not."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pyarrow as pa

from reconcile.fleet.dataset import AxisData

Row = dict[str, Any]
"""Keys are the names of SCHEMA."""

CHANNEL_UNITS = {"force": "n", "deviation": "m"}
LEVELS = ("before", "refitted", "after")
TRANSIENT = ("killed", "over time", "failed", "unreadable", "no model")
"""Failures that a repetition may cure without another recording; `unusable` recordings stay unusable."""

PARAMETER = pa.struct(
    [
        ("name", pa.string()),
        ("value", pa.float64()),
        ("low", pa.float64()),
        ("high", pa.float64()),
        ("unit", pa.string()),
    ]
)
EFFECT = pa.struct(
    [
        ("effect", pa.string()),
        ("sense", pa.string()),
        ("confidence", pa.float64()),
        ("equivalent", pa.list_(pa.string())),
        ("heldout_gain", pa.float64()),
        ("parameters", pa.list_(PARAMETER)),
    ]
)
BAD_FILE = pa.struct([("file", pa.string()), ("reason", pa.string())])
SCHEMA = pa.schema(
    [
        ("machine", pa.string()),
        ("axis", pa.string()),
        ("status", pa.string()),
        ("verdict", pa.string()),
        ("effects", pa.list_(EFFECT)),
        ("minor", pa.list_(pa.string())),
        *(
            (f"{channel}_{level}_{unit}", pa.float64())
            for channel, unit in CHANNEL_UNITS.items()
            for level in LEVELS
        ),
        ("recordings", pa.int32()),
        ("bytes", pa.int64()),
        ("bad_files", pa.list_(BAD_FILE)),
        ("error", pa.string()),
        ("seconds", pa.float64()),
        ("model", pa.string()),
        ("key", pa.string()),
    ]
)
"""`status`: diagnosed, or why not. Levels are the RMS on held-out blocks; low and high bound 95 %."""


def row_of_verdict(
    data: AxisData,
    key: str,
    verdict: Mapping[str, Any],
    bad: Sequence[Mapping[str, str]],
    *,
    recordings: int,
) -> Row:
    """Return the row of a diagnosed axis from its verdict.json; `bad` are the files that were left out."""
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
    return dict.fromkeys(SCHEMA.names) | lists | own


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
