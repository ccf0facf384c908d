"""What a watch remembers: watch.json, from which a later run goes on without reading a recording again."""

from __future__ import annotations

import copy
import hashlib
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.errors import ReconcileError
from reconcile.watch_kinds import KINDS, LEVEL, LEVEL_WORDS
from reconcile.watch_sequence import MOST, Sequence
from servo_ctrl.telemetry.parquet import reason_of, write_whole

if TYPE_CHECKING:
    from pathlib import Path

    from reconcile.watch_files import Arrival
    from reconcile.watch_indicators import Measured

FORMAT = 1
BLANK: dict[str, Any] = {
    "recordings": [],
    "forgotten": {},
    "unusable": [],
    "unfinished": [],
    "reference": {},
    "changes": [],
}
"""Nothing seen yet."""
KEPT = 2 * MOST
"""Recordings remembered; older ones are still known by name, so they are not read again."""
LEAST_SHARE = 0.02
"""Of the force that the axis needs, RMS: a change that makes less does not matter."""
LEAST_LEVEL = math.log(1.25)
"""What is left must grow by a quarter."""


class Memory:
    """The document of watch.json and questions to it. All in SI."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document

    @classmethod
    def begun(cls, model: Path, run_length: float) -> Memory:
        """Nothing seen yet. Raises ReconcileError."""
        return cls(
            {
                "format": FORMAT,
                "model": {"file": str(model), "sha256": fingerprint(model)},
                "recordings_between_false_alarms": run_length,
                **copy.deepcopy(BLANK),
            }
        )

    @classmethod
    def read(cls, file: Path) -> Memory | None:
        """As it was left; None where there is none. Raises ReconcileError."""
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
        """Whole or not at all. Raises OSError."""
        text = json.dumps(self.document, indent=1, allow_nan=False) + "\n"
        write_whole(file, lambda temporary: temporary.write_text(text, encoding="utf-8"))

    def knows(self, arrival: Arrival) -> bool:
        """Whether it was read, as it is now."""
        stamp = list(arrival.stamp)
        entries = [*self.document["recordings"], *self.document["unusable"]]
        known = {entry["name"]: entry["stamp"] for entry in entries} | self.document["forgotten"]
        return bool(known.get(arrival.path.name) == stamp)

    def add(self, arrival: Arrival, axes: dict[str, dict[str, Any]]) -> None:
        """A recording that was read, into its place in time; in the place of one of the same name."""
        self._drop(arrival.path.name)
        entry = {
            "name": arrival.path.name,
            "stamp": list(arrival.stamp),
            "started_s": arrival.started_s,
            "axes": axes,
        }
        recordings = self.document["recordings"]
        recordings.append(entry)
        recordings.sort(key=lambda one: (one["started_s"], one["name"]))
        for old in recordings[:-KEPT]:
            self.document["forgotten"][old["name"]] = old["stamp"]
        del recordings[:-KEPT]

    def refuse(self, arrival: Arrival, why: str) -> None:
        """A recording that cannot be used."""
        self._drop(arrival.path.name)
        entry = {"name": arrival.path.name, "stamp": list(arrival.stamp), "why": why}
        self.document["unusable"].append(entry)

    def of_axis(self, axis: str, since: str = "", until: str = "") -> list[dict[str, Any]]:
        """Recordings of an axis, oldest first; `since`: from this name on, `until`: before this name."""
        every = [entry for entry in self.document["recordings"] if axis in entry["axes"]]
        names = [entry["name"] for entry in every]
        first = names.index(since) if since in names else 0
        last = names.index(until) if until in names else len(every)
        return every[first:last][-MOST:]

    def axes(self) -> list[str]:
        """All that were in a recording."""
        return list(dict.fromkeys(axis for entry in self.document["recordings"] for axis in entry["axes"]))

    def _drop(self, name: str) -> None:
        for key in ("recordings", "unusable"):
            self.document[key] = [entry for entry in self.document[key] if entry["name"] != name]


def fingerprint(model: Path) -> str:
    """Of a model file, or of the plant.toml of a directory. Raises ReconcileError."""
    file = model / "plant.toml" if model.is_dir() else model
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise ReconcileError(file, "", f"cannot be read: {reason_of(error)}") from None


def entry_of(
    measured: list[Measured], features: list[float], temperature_k: float | None, resolution_m: float
) -> dict[str, Any]:
    """One axis of one recording. `resolution_m`: no deviation below it matters."""
    senses: dict[str, Any] = {}
    for one in measured:
        least = LEAST_SHARE * one.size if one.sense is Sense.FORCE else max(resolution_m, 1e-9)
        senses[one.sense.value] = {
            i.name: {
                "value": i.value,
                "error": i.error,
                "reach": i.reach,
                "least": least / i.worth if i.worth > 0.0 else LEAST_LEVEL,
                "model": i.model,
            }
            for i in one.indicators
        }
    return {"features": features, "temperature_k": temperature_k, "senses": senses}


def sequences(entries: list[dict[str, Any]], axis: str) -> dict[tuple[str, str], tuple[Sequence, list[int]]]:
    """By sense and indicator: values over the recordings that tell it, and which of `entries` those are."""
    found = {}
    for sense, kinds in KINDS.items():
        for name in [*(kind.name for kind in kinds), LEVEL]:
            places, rows = [], []
            for place, entry in enumerate(entries):
                one = entry["axes"][axis]["senses"].get(sense.value, {}).get(name)
                if one is not None:
                    places.append(place)
                    rows.append((one["value"], one["error"], one["reach"], one["least"]))
            if not rows:
                continue
            values, errors, reach, least = (np.array(column) for column in zip(*rows, strict=True))
            own = [entries[place]["axes"][axis] for place in places]
            warm = [one["temperature_k"] for one in own]
            found[sense.value, name] = (
                Sequence(
                    values,
                    errors,
                    np.array([one["features"] for one in own]),
                    np.array([math.nan if kelvin is None else kelvin for kelvin in warm]),
                    float(np.median(reach)),
                    float(np.median(least)),
                ),
                places,
            )
    return found


def words_of(sense: str, name: str) -> tuple[str, str]:
    """What an indicator is called, and its unit; of a level that of what is left."""
    for kind in KINDS[Sense(sense)]:
        if kind.name == name:
            return kind.words, kind.unit
    return LEVEL_WORDS[Sense(sense)], "N" if Sense(sense) is Sense.FORCE else "m"
