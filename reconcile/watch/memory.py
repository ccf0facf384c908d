"""watch.json: the indicators of all recordings, so that a later run does not read them again."""

import copy
import hashlib
import json
import math
from pathlib import Path
from typing import Any, Self

import numpy as np

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.errors import ReconcileError
from reconcile.watch.change_detection import MAX_RECORDINGS, Sequence
from reconcile.watch.files import Arrival
from reconcile.watch.indicators import INDICATORS, RESIDUAL_LEVEL, RESIDUAL_WORDS, MeasuredIndicators
from servo_ctrl.errors import reason_of
from servo_ctrl.files.whole_file import write_text_whole

FORMAT = 1
BLANK: dict[str, Any] = {
    "recordings": [],
    "forgotten": {},
    "unusable": [],
    "unfinished": [],
    "reference": {},
    "changes": [],
}
"""A memory without recordings."""
REMEMBERED = 2 * MAX_RECORDINGS
"""Most recordings with stored indicators; of older ones only the name is stored, to not read them again."""
MIN_FORCE_SHARE = 0.02
"""Share of the RMS force of the axis below which a change is not reported."""
MIN_LEVEL_CHANGE = math.log(1.25)
"""Least reported growth of the residual level: a quarter."""


class Memory:
    """The document of watch.json, and queries on it. All in SI."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document

    @classmethod
    def empty(cls, model: Path, run_length: float) -> Self:
        """Return a memory without recordings. Raises ReconcileError: the model cannot be read."""
        return cls(
            {
                "format": FORMAT,
                "model": {"file": str(model), "sha256": fingerprint(model)},
                "recordings_between_false_alarms": run_length,
                **copy.deepcopy(BLANK),
            }
        )

    @classmethod
    def read(cls, file: Path) -> Self | None:
        """Read a memory; None if there is none. Raises ReconcileError."""
        try:
            document = json.loads(file.read_text(encoding="utf-8"))
            known = document["format"] == FORMAT and set(BLANK) <= set(document)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise ReconcileError(file, "", f"cannot be read: {reason_of(error)}") from None
        except (ValueError, KeyError, TypeError, RecursionError):
            known = False
        if not known:
            reason = "is not what this version of a watch has written"
            raise ReconcileError(file, "", reason, "move it away; everything is read anew then")
        return cls(document)

    def write(self, file: Path) -> None:
        """Write the memory atomically. Raises OSError."""
        write_text_whole(file, json.dumps(self.document, indent=1, allow_nan=False) + "\n")

    def knows(self, arrival: Arrival) -> bool:
        """Return whether the recording was read in its present state."""
        stamp = list(arrival.stamp)
        entries = [*self.document["recordings"], *self.document["unusable"]]
        known = {entry["name"]: entry["stamp"] for entry in entries} | self.document["forgotten"]
        return bool(known.get(arrival.path.name) == stamp)

    def add(self, arrival: Arrival, axes: dict[str, dict[str, Any]]) -> None:
        """Add the indicators of a recording in order of time; replaces one of the same name."""
        entry = self._stamped(arrival) | {"started_s": arrival.started_s, "axes": axes}
        recordings = self.document["recordings"]
        recordings.append(entry)
        recordings.sort(key=lambda one: (one["started_s"], one["name"]))
        for old in recordings[:-REMEMBERED]:
            self.document["forgotten"][old["name"]] = old["stamp"]
        del recordings[:-REMEMBERED]

    def refuse(self, arrival: Arrival, why: str) -> None:
        """Store that a recording cannot be used, and the reason."""
        entry = self._stamped(arrival) | {"why": why}
        self.document["unusable"].append(entry)

    def of_axis(self, axis: str, since: str = "", until: str = "") -> list[dict[str, Any]]:
        """Return the recordings of an axis, oldest first, from `since` on and before `until` (names)."""
        every = [entry for entry in self.document["recordings"] if axis in entry["axes"]]
        names = [entry["name"] for entry in every]
        first = names.index(since) if since in names else 0
        last = names.index(until) if until in names else len(every)
        return every[first:last][-MAX_RECORDINGS:]

    def axes(self) -> list[str]:
        """Return the names of all axes that were recorded."""
        return list(dict.fromkeys(axis for entry in self.document["recordings"] for axis in entry["axes"]))

    def _stamped(self, arrival: Arrival) -> dict[str, Any]:
        """Return the beginning of an entry; removes earlier entries of the same name."""
        name = arrival.path.name
        for key in ("recordings", "unusable"):
            self.document[key] = [entry for entry in self.document[key] if entry["name"] != name]
        return {"name": name, "stamp": list(arrival.stamp)}


def fingerprint(model: Path) -> str:
    """Return the SHA-256 of a model file, or of the plant.toml of a directory. Raises ReconcileError."""
    file = model / "plant.toml" if model.is_dir() else model
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise ReconcileError(file, "", f"cannot be read: {reason_of(error)}") from None


def entry_of(
    measured: list[MeasuredIndicators],
    features: list[float],
    temperature_k: float | None,
    resolution_m: float,
) -> dict[str, Any]:
    """Return the entry of one axis of one recording; a deviation below `resolution_m` is never reported."""
    channels: dict[str, Any] = {}
    for one in measured:
        force = one.channel is ResidualChannel.FORCE
        least = MIN_FORCE_SHARE * one.size if force else max(resolution_m, 1e-9)
        channels[one.channel.value] = {
            i.name: {
                "value": i.value,
                "error": i.error,
                "reach": i.motion_spread,
                "least": least / i.rms_per_unit if i.rms_per_unit > 0.0 else MIN_LEVEL_CHANGE,
                "model": i.model,
            }
            for i in one.indicators
        }
    return {"features": features, "temperature_k": temperature_k, "senses": channels}


def sequences(entries: list[dict[str, Any]], axis: str) -> dict[tuple[str, str], tuple[Sequence, list[int]]]:
    """Return the values of each indicator, by (channel, name), and their indices in `entries`."""
    found = {}
    for channel, kinds in INDICATORS.items():
        for name in [*(kind.name for kind in kinds), RESIDUAL_LEVEL]:
            places, rows = [], []
            for place, entry in enumerate(entries):
                one = entry["axes"][axis]["senses"].get(channel.value, {}).get(name)
                if one is not None:
                    places.append(place)
                    rows.append((one["value"], one["error"], one["reach"], one["least"]))
            if not rows:
                continue
            values, errors, reach, least = (np.array(column) for column in zip(*rows, strict=True))
            own = [entries[place]["axes"][axis] for place in places]
            recorded_k = [one["temperature_k"] for one in own]
            found[channel.value, name] = (
                Sequence(
                    values=values,
                    errors=errors,
                    features=np.array([one["features"] for one in own]),
                    temperature_k=np.array([math.nan if kelvin is None else kelvin for kelvin in recorded_k]),
                    motion_spread=float(np.median(reach)),
                    min_change=float(np.median(least)),
                ),
                places,
            )
    return found


def indicator_words(channel: str, name: str) -> tuple[str, str]:
    """Return the display name of an indicator, and its unit."""
    of = ResidualChannel(channel)
    for kind in INDICATORS[of]:
        if kind.name == name:
            return kind.words, kind.unit
    return RESIDUAL_WORDS[of], "N" if of is ResidualChannel.FORCE else "m"
