"""watch.json: the indicators of all recordings, so that a later run does not read them again."""

import copy
import hashlib
import json
import math
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.errors import ReconcileError
from reconcile.watch.change_detection import MAX_RECORDINGS, IndicatorSeries
from reconcile.watch.indicators import INDICATORS, RESIDUAL_LEVEL, RESIDUAL_WORDS, MeasuredIndicators
from reconcile.watch.recording_folder import CompleteRecording
from servo_ctrl.errors import reason_of
from servo_ctrl.files.whole_file import write_text_whole

FORMAT = 1
EMPTY: dict[str, Any] = {
    "recordings": [],
    "forgotten": {},
    "unusable": [],
    "unfinished": [],
    "reference": {},
    "changes": [],
}
"""The lists of a history without recordings."""
STORED_RECORDINGS = 2 * MAX_RECORDINGS
"""Most recordings with stored indicators; of older ones only the name is stored, to not read them again."""
MIN_FORCE_SHARE = 0.02
"""Share of the RMS force of the axis below which a change is not reported; chosen."""
MIN_LEVEL_CHANGE = math.log(1.25)
"""Least reported growth of the residual level: a quarter; chosen."""


class IndicatorKey(NamedTuple):
    """Identity of an indicator of an axis, in watch.json too."""

    channel: str
    indicator: str


class IndicatorLabel(NamedTuple):
    """What an indicator is, for a reader."""

    text: str
    unit: str
    """SI."""


class RecordedSeries(NamedTuple):
    """The values of an indicator in the recordings that have it."""

    series: IndicatorSeries
    places: list[int]
    """Indices of those recordings among all entries."""


class WatchHistory:
    """The document of watch.json, and queries on it. All in SI."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document

    @classmethod
    def empty(cls, model: Path, run_length: float) -> Self:
        """Return a history without recordings. Raises ReconcileError: the model cannot be read."""
        return cls(
            {
                "format": FORMAT,
                "model": {"file": str(model), "sha256": model_sha256(model)},
                "recordings_between_false_alarms": run_length,
                **copy.deepcopy(EMPTY),
            }
        )

    @classmethod
    def read(cls, file: Path) -> Self | None:
        """Read a history; None if there is none. Raises ReconcileError."""
        try:
            document = json.loads(file.read_text(encoding="utf-8"))
            known = document["format"] == FORMAT and set(EMPTY) <= set(document)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise ReconcileError(file, "", f"cannot be read: {reason_of(error)}") from None
        except (ValueError, KeyError, TypeError, RecursionError):
            known = False
        if not known:
            reason = "is not what this version of a watch has written"
            raise ReconcileError(file, "", reason, "move it away; every recording is then read again")
        return cls(document)

    def write(self, file: Path) -> None:
        """Write the history atomically. Raises OSError."""
        write_text_whole(file, json.dumps(self.document, indent=1, allow_nan=False) + "\n")

    def contains(self, recording: CompleteRecording) -> bool:
        """Return whether the recording was read in its present state."""
        entries = [*self.document["recordings"], *self.document["unusable"]]
        stamps = {entry["name"]: entry["stamp"] for entry in entries} | self.document["forgotten"]
        return bool(stamps.get(recording.path.name) == list(recording.stamp))

    def add(self, recording: CompleteRecording, axes: dict[str, dict[str, Any]]) -> None:
        """Add the indicators of a recording in order of time; replaces one of the same name."""
        new = self._replacing_entry(recording) | {"started_s": recording.started_s, "axes": axes}
        entries = self.document["recordings"]
        entries.append(new)
        entries.sort(key=lambda entry: (entry["started_s"], entry["name"]))
        for old in entries[:-STORED_RECORDINGS]:
            self.document["forgotten"][old["name"]] = old["stamp"]
        del entries[:-STORED_RECORDINGS]

    def add_unusable(self, recording: CompleteRecording, why: str) -> None:
        """Store that a recording cannot be used, and the reason."""
        entry = self._replacing_entry(recording) | {"why": why}
        self.document["unusable"].append(entry)

    def of_axis(self, axis: str, since: str = "", until: str = "") -> list[dict[str, Any]]:
        """Return the recordings of an axis, oldest first, from `since` on and before `until` (names)."""
        entries = [entry for entry in self.document["recordings"] if axis in entry["axes"]]
        names = [entry["name"] for entry in entries]
        first = names.index(since) if since in names else 0
        end = names.index(until) if until in names else len(entries)
        return entries[first:end][-MAX_RECORDINGS:]

    def axes(self) -> list[str]:
        """Return the names of all axes that were recorded."""
        return list(dict.fromkeys(axis for entry in self.document["recordings"] for axis in entry["axes"]))

    def _replacing_entry(self, recording: CompleteRecording) -> dict[str, Any]:
        """Remove the entries of the same name; return the beginning of a new one."""
        name = recording.path.name
        for key in ("recordings", "unusable"):
            self.document[key] = [entry for entry in self.document[key] if entry["name"] != name]
        return {"name": name, "stamp": list(recording.stamp)}


def model_sha256(model: Path) -> str:
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
    for of_channel in measured:
        is_force = of_channel.channel is ResidualChannel.FORCE
        least_rms = MIN_FORCE_SHARE * of_channel.size if is_force else max(resolution_m, 1e-9)
        channels[of_channel.channel.value] = {
            indicator.name: {
                "value": indicator.value,
                "error": indicator.error,
                "reach": indicator.motion_spread,
                "least": (
                    least_rms / indicator.rms_per_unit if indicator.rms_per_unit > 0.0 else MIN_LEVEL_CHANGE
                ),
                "model": indicator.model,
            }
            for indicator in of_channel.indicators
        }
    return {"features": features, "temperature_k": temperature_k, "senses": channels}


def indicator_series(entries: list[dict[str, Any]], axis: str) -> dict[IndicatorKey, RecordedSeries]:
    """Return the values of each indicator of an axis that any of the entries has."""
    by_key = {}
    for channel, kinds in INDICATORS.items():
        for name in [*(kind.name for kind in kinds), RESIDUAL_LEVEL]:
            key = IndicatorKey(channel.value, name)
            recorded = _recorded_series(entries, axis, key)
            if recorded is not None:
                by_key[key] = recorded
    return by_key


def _recorded_series(entries: list[dict[str, Any]], axis: str, key: IndicatorKey) -> RecordedSeries | None:
    places, indicators = [], []
    for place, entry in enumerate(entries):
        indicator = entry["axes"][axis]["senses"].get(key.channel, {}).get(key.indicator)
        if indicator is not None:
            places.append(place)
            indicators.append(indicator)
    if not indicators:
        return None
    of_axis = [entries[place]["axes"][axis] for place in places]
    temperature_k = [entry["temperature_k"] for entry in of_axis]
    series = IndicatorSeries(
        values=np.array([indicator["value"] for indicator in indicators]),
        errors=np.array([indicator["error"] for indicator in indicators]),
        features=np.array([entry["features"] for entry in of_axis]),
        temperature_k=np.array([math.nan if kelvin is None else kelvin for kelvin in temperature_k]),
        motion_spread=float(np.median([indicator["reach"] for indicator in indicators])),
        min_change=float(np.median([indicator["least"] for indicator in indicators])),
    )
    return RecordedSeries(series, places)


def indicator_label(key: IndicatorKey) -> IndicatorLabel:
    """Return the display name of an indicator, and its unit."""
    channel = ResidualChannel(key.channel)
    for kind in INDICATORS[channel]:
        if kind.name == key.indicator:
            return IndicatorLabel(kind.words, kind.unit)
    return IndicatorLabel(RESIDUAL_WORDS[channel], "N" if channel is ResidualChannel.FORCE else "m")
