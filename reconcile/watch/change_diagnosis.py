"""Locates a change and names its physics: diagnoses the recordings after it with a model of those before."""

import math
from collections.abc import Mapping as ByName
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.formats.mapping import Mapping
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.recording import AxisRecording, load_recordings
from reconcile.sensing.checks import examine
from reconcile.watch.compare import ChangeProfile, compare
from reconcile.watch.history import WatchHistory
from servo_ctrl.files.diagnosis_files import MODEL_FILE, REPORT_FILE

RECORDINGS_PER_SIDE = 4
"""Recordings before and after the change, nearest to it; more cost time. Chosen, not calibrated."""
MIN_RMS_RATIO = 1.3
"""Least growth of the RMS residual of the other channel for the change to be located there too."""
DIGITS = 5
"""Significant digits of a profile in watch.json."""


class ProgressCallback(Protocol):
    """Receives one line of progress."""

    def __call__(self, text: str, /, *, lasting: bool) -> None:
        """Show `text` until the next one, or permanently if `lasting`."""


class ChangeDiagnosis:
    """Locates changes; if `full`, also names them by two diagnoses, which take seconds."""

    def __init__(
        self,
        folder: Path,
        model_file: Path,
        out: Path,
        axes: ByName[str, NominalAxis],
        mapping: Mapping,
        *,
        full: bool,
    ) -> None:
        self._folder, self._model_file, self._out = folder, model_file, out
        self._axes, self._mapping, self._full = axes, mapping, full

    def describe(
        self, change: dict[str, Any], history: WatchHistory, report_progress: ProgressCallback
    ) -> None:
        """Add `where`, `profiles` and `named` to a change; `named` holds the reason of a failure."""
        paths = self._paths(change, history)
        change["compared"] = {
            "before": [path.name for path in paths.before],
            "after": [path.name for path in paths.after],
        }
        change["where"], change["profiles"], change["named"] = [], [], None
        try:
            self._locate(change, paths)
            if self._full:
                report_progress(f"naming the change of axis {change['axis']}", lasting=False)
                change["named"] = self._diagnose(change, paths)
        except ReconcileError as error:
            change["named"] = {"verdict": "none", "why": str(error), "findings": []}

    def _locate(self, change: dict[str, Any], paths: "_ComparedPaths") -> None:
        """Add `where` and `profiles`, of the channel with the clearest alarm first."""
        axis = change["axis"]
        before, after = self._recordings(axis, paths.before), self._recordings(axis, paths.after)
        clearest = ResidualChannel(change["clearest"][0])
        for channel in sorted(ResidualChannel, key=lambda channel: channel is not clearest):
            before_here, after_here = _with_channel(before, channel), _with_channel(after, channel)
            if not before_here or not after_here:
                continue
            comparison = compare(before_here, after_here, self._axes[axis], channel)
            if channel is not clearest and comparison.rms_after < MIN_RMS_RATIO * comparison.rms_before:
                continue
            rms = {"before": comparison.rms_before, "after": comparison.rms_after}
            change["where"] += [{**located, "rms": rms} for located in comparison.located]
            change["profiles"] += [_profile_json(channel, profile) for profile in comparison.profiles]

    def _paths(self, change: dict[str, Any], history: WatchHistory) -> "_ComparedPaths":
        """Return the recordings to compare; fewer after a ramp, because they differ from each other."""
        axis, earliest_onset = change["axis"], change["began"]["interval95"][0]
        before = history.of_axis(axis, change["reference"], earliest_onset)
        after = history.of_axis(axis, change["began"]["recording"])
        first = history.of_axis(axis, change["reference"])[:1]
        newest = RECORDINGS_PER_SIDE if change["form"] == "step" else RECORDINGS_PER_SIDE // 2
        return _ComparedPaths(
            before=[self._folder / entry["name"] for entry in (before or first)[-RECORDINGS_PER_SIDE:]],
            after=[self._folder / entry["name"] for entry in after[-newest:]],
        )

    def _recordings(self, axis: str, paths: Sequence[Path]) -> list[AxisRecording]:
        axes = {axis: self._axes[axis]}
        return examine(load_recordings(paths, axes, self._mapping), axes).recordings

    def _diagnose(self, change: dict[str, Any], paths: "_ComparedPaths") -> dict[str, Any]:
        """Diagnose the recordings after the change against a model that is updated by those before."""
        folder = self._out / change["id"]
        before = diagnose(paths.before, self._model_file, folder / "before", self._mapping, with_report=False)
        after = diagnose(paths.after, before.model_file, folder / "after", self._mapping)
        # an effect before the change that the written model could not hold is not a change
        present = {(finding["axis"], finding["effect"]) for finding in before.verdict["findings"]}
        findings = [
            finding
            for finding in after.verdict["findings"]
            if finding["axis"] == change["axis"] and (finding["axis"], finding["effect"]) not in present
        ]
        return {
            "verdict": after.verdict["verdict"],
            "findings": findings,
            "model": str((folder / "after" / MODEL_FILE).relative_to(self._out)),
            "report": str((folder / "after" / REPORT_FILE).relative_to(self._out)),
        }


class _ComparedPaths(NamedTuple):
    """Recordings before the earliest onset of a change, and the newest ones."""

    before: list[Path]
    after: list[Path]


def _with_channel(recordings: Sequence[AxisRecording], channel: ResidualChannel) -> list[AxisRecording]:
    """The recordings that have a channel: the deviation needs a scale."""
    return [one for one in recordings if channel is ResidualChannel.FORCE or one.scale_m is not None]


def _profile_json(channel: ResidualChannel, profile: ChangeProfile) -> dict[str, Any]:
    """An entry of `profiles` in watch.json."""

    def rounded(values: Sequence[float]) -> list[float | None]:
        return [float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None for value in values]

    coordinate, sides = profile.coordinate, (("before", profile.before), ("after", profile.after))
    return {
        "sense": channel.value,
        "coordinate": coordinate.name,
        "unit": coordinate.unit,
        "centres": rounded(coordinate.centres.tolist()),
        "labels": list(coordinate.labels),
        "logarithmic": coordinate.logarithmic,
        "by_direction": profile.by_direction,
        **{
            side: {"mean": rounded(bins.mean.tolist()), "error": rounded(bins.errors.tolist())}
            for side, bins in sides
        },
    }
