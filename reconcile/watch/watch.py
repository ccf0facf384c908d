"""`reconcile watch`: reads new recordings of a machine, tests each against earlier ones, reports changes."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.errors import ReconcileError
from reconcile.formats.mapping import NO_MAPPING, Mapping
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording, load_recordings
from reconcile.sensing.checks import examine
from reconcile.watch.change import ChangeUpdate, change_of, is_continuation, updated
from reconcile.watch.change_detection import Alarm, newest_alarm
from reconcile.watch.change_diagnosis import ChangeDiagnosis, ProgressCallback
from reconcile.watch.files import Arrival, Arrivals
from reconcile.watch.indicators import measure, motion_features
from reconcile.watch.memory import Memory, entry_of, fingerprint, sequences
from reconcile.watch.page import write_page

FILE, PAGE = "watch.json", "watch.html"
WRITE_EVERY = 20
"""Number of new recordings after which the memory is written while reading continues."""


class WatchOptions(NamedTuple):
    """Options of a watch."""

    axes: tuple[str, ...] = ()
    """Axes of the model; empty: all."""
    run_length: float = 1000.0
    """Least mean number of recordings between false alarms."""
    diagnose: bool = True
    """Whether two diagnoses name the physics of a change."""
    mapping: Mapping = NO_MAPPING


def _discard(_text: str, /, *, lasting: bool) -> None:
    pass


class Watch:
    """A watched folder. Raises ReconcileError: model, folder or an earlier watch.json cannot be used."""

    def __init__(self, folder: Path, model_file: Path, out: Path, options: WatchOptions) -> None:
        model = load_model(model_file)
        unknown = [name for name in options.axes if name not in model.axes]
        if unknown:
            has = ", ".join(model.axes)
            raise ReconcileError(model.file, f"axis {unknown[0]}", f"is not in the model, only {has}")
        self._axes = {name: model.axes[name] for name in options.axes or model.axes}
        self.arrivals = Arrivals(folder, out)
        self._options, self._out = options, out
        self._report_progress: ProgressCallback = _discard
        self._diagnosis = ChangeDiagnosis(
            folder, model_file, out, self._axes, options.mapping, full=options.diagnose
        )
        self.memory = self._load_memory(model_file)

    def read_new(self, report_progress: ProgressCallback = _discard) -> list[dict[str, Any]]:
        """Read new recordings; return the changes that are new or refined. Raises ReconcileError, OSError."""
        self._report_progress = report_progress
        new = [one for one in self.arrivals.list_complete() if not self.memory.knows(one)]
        reported: dict[str, dict[str, Any]] = {}
        for number, arrival in enumerate(new, start=1):
            self._report_progress(f"{arrival.path.name} ({number} of {len(new)})", lasting=False)
            for change in self._read(arrival):
                reported[change["id"]] = change
            if number % WRITE_EVERY == 0:
                self.write_memory()
        if new or self.arrivals.unfinished != self.memory.document["unfinished"]:
            self.memory.document["unfinished"] = self.arrivals.unfinished
            self.write_memory()
            write_page(self.memory, self._out / PAGE)
        return list(reported.values())

    def write_memory(self) -> None:
        """Write the memory. Raises OSError."""
        self._out.mkdir(parents=True, exist_ok=True)
        self.memory.write(self._out / FILE)

    def _load_memory(self, model_file: Path) -> Memory:
        memory = Memory.read(self._out / FILE)
        if memory is None or memory.document["model"]["sha256"] != fingerprint(model_file):
            return Memory.empty(model_file, self._options.run_length)
        memory.document["recordings_between_false_alarms"] = self._options.run_length
        return memory

    def _read(self, arrival: Arrival) -> list[dict[str, Any]]:
        try:
            axes = self._measure(arrival)
        except ReconcileError as error:
            self.memory.refuse(arrival, str(error))
            self._report_progress(f"not used: {error}", lasting=True)
            return []
        self.memory.add(arrival, axes)
        return [change for axis in axes for change in self._test(axis)]

    def _measure(self, arrival: Arrival) -> dict[str, dict[str, Any]]:
        """Measure the indicators of a recording; return its entries by axis."""
        given = load_recordings([arrival.path], self._axes, self._options.mapping)
        recordings = examine(given, self._axes).recordings
        found = {}
        for name, axis in self._axes.items():
            pieces = [recording for recording in recordings if recording.axis == name]
            if not pieces:
                continue
            measured = [measure(pieces, axis, ResidualChannel.FORCE)]
            with_scale = [piece for piece in pieces if piece.scale_m is not None]
            if with_scale:
                measured.append(measure(with_scale, axis, ResidualChannel.POSITION_DEVIATION))
            resolution_m = max(axis.encoder_resolution_m or 0.0, axis.scale_resolution_m or 0.0)
            features = motion_features(measured[0].datasets)
            found[name] = entry_of(measured, features, _temperature_k(pieces), resolution_m)
        return found

    def _test(self, axis: str) -> list[dict[str, Any]]:
        """Test the newest recording; return a new change, or an open one that it refines."""
        memory, document = self.memory, self.memory.document
        since = document["reference"].get(axis, "")
        entries = memory.of_axis(axis, since)
        known = sequences(entries, axis)
        together = len(known) * len(self._axes)
        raised: dict[tuple[str, str], Alarm] = {}
        for key, (sequence, places) in known.items():
            if places[-1] == len(entries) - 1:
                alarm = newest_alarm(sequence, together, self._options.run_length)
                if alarm is not None and alarm.raised:
                    raised[key] = alarm
        own = [change for change in document["changes"] if change["axis"] == axis]
        if raised and not (own and is_continuation(own[-1], raised)):
            for earlier in own:
                earlier["open"] = False
            first = max(raised, key=lambda key: abs(raised[key].t) / raised[key].threshold)
            change = change_of(axis, len(own) + 1, first, entries, since)
            document["changes"].append(change)
            update = ChangeUpdate(report=True, diagnose=True)
        elif own and own[-1]["open"]:
            change = own[-1]
            update = updated(change, memory.of_axis(axis, change["reference"]))
        else:
            return []
        document["reference"][axis] = change["began"]["recording"]
        if update.diagnose:
            self._diagnosis.describe(change, memory, self._report_progress)
        if not any(update):
            return []
        if change not in own:
            self._report_progress(f"CHANGE: {change['sentence']}", lasting=True)
        change["published"] = False
        return [change]


def _temperature_k(pieces: list[AxisRecording]) -> float | None:
    recorded_k = [piece.temperature_k for piece in pieces if piece.temperature_k is not None]
    mean = float(np.mean(np.concatenate(recorded_k))) if recorded_k else math.nan
    return mean if math.isfinite(mean) else None
