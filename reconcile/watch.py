"""`reconcile watch`: each new recording of a machine against those before it, until it leaves its model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.errors import ReconcileError
from reconcile.model_file import load_model
from reconcile.recording import load_recordings
from reconcile.sensing import examine
from reconcile.watch_change import News, change_of, goes_on, updated
from reconcile.watch_files import Arrivals
from reconcile.watch_indicators import measure, scene_features
from reconcile.watch_memory import Memory, entry_of, fingerprint, sequences
from reconcile.watch_name import Namer
from reconcile.watch_page import write_page
from reconcile.watch_sequence import judged

if TYPE_CHECKING:
    from pathlib import Path

    from reconcile.recording import AxisRecording, ReadOptions
    from reconcile.watch_files import Arrival
    from reconcile.watch_sequence import Alarm

FILE, PAGE = "watch.json", "watch.html"
EVERY = 20
"""Recordings after which what was learned is written, where many wait."""


class Say(Protocol):
    """Progress: what passes by, and what should stay to be read."""

    def __call__(self, text: str, /, *, lasting: bool) -> None:
        """One line."""


def _silent(_text: str, /, *, lasting: bool) -> None:
    """Nobody listens."""


class Options(NamedTuple):
    """How to watch."""

    axes: tuple[str, ...] = ()
    """Of the model; none: all."""
    run_length: float = 1000.0
    """Recordings between two false alarms, at least."""
    diagnose: bool = True
    """Name what has changed by two diagnoses."""


class Watch:
    """Raises ReconcileError where model, folder or an earlier watch.json cannot be used."""

    def __init__(
        self,
        folder: Path,
        model_file: Path,
        out: Path,
        options: Options,
        reading: ReadOptions | None = None,
    ) -> None:
        model = load_model(model_file)
        unknown = [name for name in options.axes if name not in model.axes]
        if unknown:
            has = ", ".join(model.axes)
            raise ReconcileError(model.file, f"axis {unknown[0]}", f"is not in the model, only {has}")
        wanted = options.axes or tuple(model.axes)
        self._axes = {name: model.axes[name] for name in wanted}
        self._arrivals = Arrivals(folder, out)
        self._options, self._reading = options, reading
        self._say: Say = _silent
        self._out = out
        self._namer = Namer(folder, model_file, out, self._axes, reading, full=options.diagnose)
        self.memory = self._recalled(model_file)

    @property
    def unfinished(self) -> list[str]:
        """Recordings that were still being written at the last look."""
        return list(self._arrivals.unfinished)

    @property
    def machine(self) -> str:
        """What the recordings call it, else what their folder is called."""
        return self._arrivals.machine()

    def look(self, say: Say = _silent) -> list[dict[str, Any]]:
        """Read what is new; the changes that are new or known better now. Raises ReconcileError, OSError."""
        self._say = say
        new = [one for one in self._arrivals.look() if not self.memory.knows(one)]
        told: dict[str, dict[str, Any]] = {}
        for number, arrival in enumerate(new, start=1):
            self._say(f"{arrival.path.name} ({number} of {len(new)})", lasting=False)
            for change in self._take(arrival):
                told[change["id"]] = change
            if number % EVERY == 0:
                self._write(page=False)
        if new or self.unfinished != self.memory.document["unfinished"]:
            self.memory.document["unfinished"] = self.unfinished
            self._write(page=True)
        return list(told.values())

    def remember(self) -> None:
        """Write what has changed in the memory itself."""
        self._write(page=False)

    def _recalled(self, model_file: Path) -> Memory:
        memory = Memory.read(self._out / FILE)
        if memory is None:
            return Memory.begun(model_file, self._options.run_length)
        document = memory.document
        if document["model"]["sha256"] != fingerprint(model_file):
            return Memory.begun(model_file, self._options.run_length)
        document["recordings_between_false_alarms"] = self._options.run_length
        return memory

    def _take(self, arrival: Arrival) -> list[dict[str, Any]]:
        try:
            axes = self._measured(arrival)
        except ReconcileError as error:
            self.memory.refuse(arrival, str(error))
            self._say(f"not used: {error}", lasting=True)
            return []
        self.memory.add(arrival, axes)
        told = []
        for axis in axes:
            told += self._judged(axis)
        return told

    def _measured(self, arrival: Arrival) -> dict[str, dict[str, Any]]:
        """By axis, what is remembered of a recording."""
        given = load_recordings([arrival.path], self._axes, self._reading)
        recordings = examine(given, self._axes).recordings
        found = {}
        for name, axis in self._axes.items():
            pieces = [recording for recording in recordings if recording.axis == name]
            if not pieces:
                continue
            measured = [measure(pieces, axis, Sense.FORCE)]
            with_scale = [piece for piece in pieces if piece.scale_m is not None]
            if with_scale:
                measured.append(measure(with_scale, axis, Sense.DEVIATION))
            resolution_m = max(axis.encoder_resolution_m or 0.0, axis.scale_resolution_m or 0.0)
            features = scene_features(measured[0].found.scenes)
            found[name] = entry_of(measured, features, _temperature_k(pieces), resolution_m)
        return found

    def _judged(self, axis: str) -> list[dict[str, Any]]:
        """Whether the newest recording raises an alarm; else what it tells of the last change."""
        memory, document = self.memory, self.memory.document
        since = document["reference"].get(axis, "")
        entries = memory.of_axis(axis, since)
        known = sequences(entries, axis)
        together = len(known) * len(self._axes)
        raised: dict[tuple[str, str], Alarm] = {}
        for key, (sequence, places) in known.items():
            if places[-1] == len(entries) - 1:
                alarm = judged(sequence, together, self._options.run_length)
                if alarm is not None and alarm.raised:
                    raised[key] = alarm
        own = [change for change in document["changes"] if change["axis"] == axis]
        if raised and not (own and goes_on(own[-1], raised)):
            for earlier in own:
                earlier["open"] = False
            first = max(raised, key=lambda key: abs(raised[key].t) / raised[key].needed)
            number = len(own) + 1
            change = change_of(axis, number, first, entries, since)
            document["changes"].append(change)
            news = News(said=True, name=True)
        elif own and own[-1]["open"]:
            change = own[-1]
            news = updated(change, memory.of_axis(axis, change["reference"]))
        else:
            return []
        document["reference"][axis] = change["began"]["recording"]
        if news.name:
            self._namer.name(change, memory, self._say)
        if not any(news):
            return []
        if change not in own:
            self._say(f"CHANGE: {change['sentence']}", lasting=True)
        change["published"] = False
        return [change]

    def _write(self, *, page: bool) -> None:
        self._out.mkdir(parents=True, exist_ok=True)
        self.memory.write(self._out / FILE)
        if page:
            write_page(self.memory, self._out / PAGE)


def _temperature_k(pieces: list[AxisRecording]) -> float | None:
    warm = [piece.temperature_k for piece in pieces if piece.temperature_k is not None]
    mean = float(np.mean(np.concatenate(warm))) if warm else math.nan
    return mean if math.isfinite(mean) else None
