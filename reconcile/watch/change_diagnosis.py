"""Locates a change and names its physics: diagnoses the recordings after it with a model of those before."""

import math
from collections.abc import Mapping as ByName
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.formats.mapping import Mapping
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.recording import AxisRecording, load_recordings
from reconcile.sensing.checks import examine
from reconcile.watch.compare import ChangeProfile, compare
from reconcile.watch.memory import Memory
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

    def describe(self, change: dict[str, Any], memory: Memory, report_progress: ProgressCallback) -> None:
        """Add `where`, `profiles` and `named` to a change; `named` holds the reason of a failure."""
        old, new = self._sides(change, memory)
        change["compared"] = {"before": [path.name for path in old], "after": [path.name for path in new]}
        change["where"], change["profiles"], change["named"] = [], [], None
        try:
            sides = [self._recordings(change["axis"], paths) for paths in (old, new)]
            clearest = ResidualChannel(change["clearest"][0])
            for channel in sorted(ResidualChannel, key=lambda one: one is not clearest):
                before, after = (
                    [one for one in side if channel is ResidualChannel.FORCE or one.scale_m is not None]
                    for side in sides
                )
                if before and after:
                    found = compare(before, after, self._axes[change["axis"]], channel)
                    if channel is not clearest and found.rms[1] < MIN_RMS_RATIO * found.rms[0]:
                        continue
                    rms = {"before": found.rms[0], "after": found.rms[1]}
                    change["where"] += [{**one, "rms": rms} for one in found.located]
                    change["profiles"] += [_profile(channel, one) for one in found.profiles]
            if self._full:
                report_progress(f"naming the change of axis {change['axis']}", lasting=False)
                change["named"] = self._diagnose(change, old, new)
        except ReconcileError as error:
            change["named"] = {"verdict": "none", "why": str(error), "findings": []}

    def _sides(self, change: dict[str, Any], memory: Memory) -> tuple[list[Path], list[Path]]:
        """Return recordings before the earliest onset, and the newest ones; of a ramp fewer: they differ."""
        axis, low = change["axis"], change["began"]["interval95"][0]
        before = memory.of_axis(axis, change["reference"], low)
        after = memory.of_axis(axis, change["began"]["recording"])
        first = memory.of_axis(axis, change["reference"])[:1]
        newest = RECORDINGS_PER_SIDE if change["form"] == "step" else RECORDINGS_PER_SIDE // 2
        old = [self._folder / one["name"] for one in (before or first)[-RECORDINGS_PER_SIDE:]]
        new = [self._folder / one["name"] for one in after[-newest:]]
        return old, new

    def _recordings(self, axis: str, paths: Sequence[Path]) -> list[AxisRecording]:
        own = {axis: self._axes[axis]}
        return examine(load_recordings(paths, own, self._mapping), own).recordings

    def _diagnose(self, change: dict[str, Any], old: Sequence[Path], new: Sequence[Path]) -> dict[str, Any]:
        folder = self._out / change["id"]
        before = diagnose(old, self._model_file, folder / "before", self._mapping, with_report=False)
        found = diagnose(new, before.model_file, folder / "after", self._mapping)
        known = {(one["axis"], one["effect"]) for one in before.verdict["findings"]}
        own = [one for one in found.verdict["findings"] if one["axis"] == change["axis"]]
        # an effect of the recordings before that the written model could not hold is no change
        own = [one for one in own if (one["axis"], one["effect"]) not in known]
        return {
            "verdict": found.verdict["verdict"],
            "findings": own,
            "model": str((folder / "after" / MODEL_FILE).relative_to(self._out)),
            "report": str((folder / "after" / REPORT_FILE).relative_to(self._out)),
        }


def _profile(channel: ResidualChannel, one: ChangeProfile) -> dict[str, Any]:
    def numbers(values: Sequence[float]) -> list[float | None]:
        return [float(f"{v:.{DIGITS}g}") if math.isfinite(v) else None for v in values]

    over, sides = one.coordinate, (("before", one.before), ("after", one.after))
    return {
        "sense": channel.value,
        "coordinate": over.name,
        "unit": over.unit,
        "centres": numbers(over.centres.tolist()),
        "labels": list(over.labels),
        "logarithmic": over.logarithmic,
        "by_direction": one.by_direction,
        **{name: {"mean": numbers(m.tolist()), "error": numbers(e.tolist())} for name, (m, e) in sides},
    }
