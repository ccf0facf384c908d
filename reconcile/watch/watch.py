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
from reconcile.watch.change import ChangeUpdate, change_of, is_continuation, refine
from reconcile.watch.change_detection import Alarm, newest_alarm
from reconcile.watch.change_diagnosis import ChangeDiagnosis, ProgressCallback
from reconcile.watch.history import IndicatorKey, WatchHistory, entry_of, indicator_series, model_sha256
from reconcile.watch.indicators import measure, motion_features
from reconcile.watch.page import write_page
from reconcile.watch.recording_folder import CompleteRecording, RecordingFolder

FILE, PAGE = "watch.json", "watch.html"
WRITE_EVERY = 20
"""Number of new recordings after which the history is written while reading continues."""


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
        missing = [name for name in options.axes if name not in model.axes]
        if missing:
            present = ", ".join(model.axes)
            raise ReconcileError(model.file, f"axis {missing[0]}", f"is not in the model, only {present}")
        self._axes = {name: model.axes[name] for name in options.axes or model.axes}
        self.recording_folder = RecordingFolder(folder, out)
        self._options, self._out = options, out
        self._report_progress: ProgressCallback = _discard
        self._diagnosis = ChangeDiagnosis(
            folder, model_file, out, self._axes, options.mapping, full=options.diagnose
        )
        self.history = self._load_history(model_file)

    def read_new(self, report_progress: ProgressCallback = _discard) -> list[dict[str, Any]]:
        """Read new recordings; return the changes that are new or refined. Raises ReconcileError, OSError."""
        self._report_progress = report_progress
        new = [
            recording
            for recording in self.recording_folder.list_complete()
            if not self.history.contains(recording)
        ]
        reported: dict[str, dict[str, Any]] = {}
        for number, recording in enumerate(new, start=1):
            self._report_progress(f"{recording.path.name} ({number} of {len(new)})", lasting=False)
            for change in self._read(recording):
                reported[change["id"]] = change
            if number % WRITE_EVERY == 0:
                self.write_history()
        if new or self.recording_folder.unfinished != self.history.document["unfinished"]:
            self.history.document["unfinished"] = self.recording_folder.unfinished
            self.write_history()
            write_page(self.history, self._out / PAGE)
        return list(reported.values())

    def write_history(self) -> None:
        """Write the history. Raises OSError."""
        self._out.mkdir(parents=True, exist_ok=True)
        self.history.write(self._out / FILE)

    def _load_history(self, model_file: Path) -> WatchHistory:
        history = WatchHistory.read(self._out / FILE)
        if history is None or history.document["model"]["sha256"] != model_sha256(model_file):
            return WatchHistory.empty(model_file, self._options.run_length)
        history.document["recordings_between_false_alarms"] = self._options.run_length
        return history

    def _read(self, recording: CompleteRecording) -> list[dict[str, Any]]:
        """Measure and store a recording; return the changes that it reveals or refines."""
        try:
            entries = self._measure(recording)
        except ReconcileError as error:
            self.history.add_unusable(recording, str(error))
            self._report_progress(f"not used: {error}", lasting=True)
            return []
        self.history.add(recording, entries)
        return [change for axis in entries for change in self._test(axis)]

    def _measure(self, recording: CompleteRecording) -> dict[str, dict[str, Any]]:
        """Measure the indicators of a recording; return its entries by axis."""
        loaded = load_recordings([recording.path], self._axes, self._options.mapping)
        recordings = examine(loaded, self._axes).recordings
        entries = {}
        for name, axis in self._axes.items():
            pieces = [piece for piece in recordings if piece.axis == name]
            if not pieces:
                continue
            measured = [measure(pieces, axis, ResidualChannel.FORCE)]
            with_scale = [piece for piece in pieces if piece.scale_m is not None]
            if with_scale:
                measured.append(measure(with_scale, axis, ResidualChannel.POSITION_DEVIATION))
            resolution_m = max(axis.encoder_resolution_m or 0.0, axis.scale_resolution_m or 0.0)
            features = motion_features(measured[0].datasets)
            entries[name] = entry_of(measured, features, _mean_temperature_k(pieces), resolution_m)
        return entries

    def _test(self, axis: str) -> list[dict[str, Any]]:
        """Test the newest recording; return a new change, or an open one that it refines."""
        history, document = self.history, self.history.document
        since = document["reference"].get(axis, "")
        entries = history.of_axis(axis, since)
        raised = self._raised_alarms(entries, axis)
        previous = [change for change in document["changes"] if change["axis"] == axis]
        if raised and not (previous and is_continuation(previous[-1], raised)):
            for earlier in previous:
                earlier["open"] = False
            clearest = max(raised, key=lambda key: abs(raised[key].t) / raised[key].threshold)
            change = change_of(axis, len(previous) + 1, clearest, entries, since)
            document["changes"].append(change)
            update = ChangeUpdate(report=True, diagnose=True)
        elif previous and previous[-1]["open"]:
            change = previous[-1]
            update = refine(change, history.of_axis(axis, change["reference"]))
        else:
            return []
        document["reference"][axis] = change["began"]["recording"]
        if update.diagnose:
            self._diagnosis.describe(change, history, self._report_progress)
        if not any(update):
            return []
        if change not in previous:
            self._report_progress(f"CHANGE: {change['sentence']}", lasting=True)
        change["published"] = False
        return [change]

    def _raised_alarms(self, entries: list[dict[str, Any]], axis: str) -> dict[IndicatorKey, Alarm]:
        """Return the alarms of the indicators that the newest recording has."""
        by_key = indicator_series(entries, axis)
        tested = len(by_key) * len(self._axes)
        raised = {}
        for key, (series, places) in by_key.items():
            if places[-1] == len(entries) - 1:
                alarm = newest_alarm(series, tested, self._options.run_length)
                if alarm is not None and alarm.raised:
                    raised[key] = alarm
        return raised


def _mean_temperature_k(pieces: list[AxisRecording]) -> float | None:
    recorded_k = [piece.temperature_k for piece in pieces if piece.temperature_k is not None]
    mean = float(np.mean(np.concatenate(recorded_k))) if recorded_k else math.nan
    return mean if math.isfinite(mean) else None
