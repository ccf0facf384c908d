"""What has changed, and where: the recordings after a change against a model of those before it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from reconcile.catalogue.kinds import Sense
from reconcile.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.recording import load_recordings
from reconcile.sensing import examine
from reconcile.watch_compare import compare

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from reconcile.model_file import NominalAxis
    from reconcile.recording import AxisRecording, ReadOptions
    from reconcile.watch import Say
    from reconcile.watch_compare import Profile
    from reconcile.watch_memory import Memory

MOST = 4
"""Recordings on either side, those next to the change."""
GREW = 1.3
"""Times as large what is left must be for the other sense to be told of too."""
DIGITS = 5


class Namer:
    """`full`: by two diagnoses, which take some seconds; else only where the change shows."""

    def __init__(
        self,
        folder: Path,
        model_file: Path,
        out: Path,
        axes: Mapping[str, NominalAxis],
        reading: ReadOptions | None,
        *,
        full: bool,
    ) -> None:
        self._folder, self._model_file, self._out = folder, model_file, out
        self._axes, self._reading, self._full = axes, reading, full

    def name(self, change: dict[str, Any], memory: Memory, say: Say) -> None:
        """Put `where`, `profiles` and `named` into a change; what cannot be read any more is said there."""
        old, new = self._sides(change, memory)
        change["compared"] = {"before": [path.name for path in old], "after": [path.name for path in new]}
        change["where"], change["profiles"], change["named"] = [], [], None
        try:
            sides = [self._recordings(change["axis"], paths) for paths in (old, new)]
            clearest = Sense(change["clearest"][0])
            for sense in sorted(Sense, key=lambda one: one is not clearest):
                before, after = (
                    [one for one in side if sense is Sense.FORCE or one.scale_m is not None] for side in sides
                )
                if before and after:
                    found = compare(before, after, self._axes[change["axis"]], sense)
                    if sense is not clearest and found.rms[1] < GREW * found.rms[0]:
                        continue
                    rms = {"before": found.rms[0], "after": found.rms[1]}
                    change["where"] += [{**one, "rms": rms} for one in found.located]
                    change["profiles"] += [_profile(sense, one) for one in found.profiles]
            if self._full:
                say(f"naming the change of axis {change['axis']}", lasting=False)
                change["named"] = self._named(change, old, new)
        except ReconcileError as error:
            change["named"] = {"verdict": "none", "why": str(error), "findings": []}

    def _sides(self, change: dict[str, Any], memory: Memory) -> tuple[list[Path], list[Path]]:
        """Recordings before it can have begun, and the newest; of what grows few: they differ themselves."""
        axis, low = change["axis"], change["began"]["interval95"][0]
        before = memory.of_axis(axis, change["reference"], low)
        after = memory.of_axis(axis, change["began"]["recording"])
        first = memory.of_axis(axis, change["reference"])[:1]
        newest = MOST if change["form"] == "step" else MOST // 2
        old = [self._folder / one["name"] for one in (before or first)[-MOST:]]
        new = [self._folder / one["name"] for one in after[-newest:]]
        return old, new

    def _recordings(self, axis: str, paths: Sequence[Path]) -> list[AxisRecording]:
        own = {axis: self._axes[axis]}
        return examine(load_recordings(paths, own, self._reading), own).recordings

    def _named(self, change: dict[str, Any], old: Sequence[Path], new: Sequence[Path]) -> dict[str, Any]:
        folder = self._out / change["id"]
        before = diagnose(old, self._model_file, folder / "before", self._reading, with_report=False)
        found = diagnose(new, before.model_file, folder / "after", self._reading)
        known = {(one["axis"], one["effect"]) for one in before.verdict["findings"]}
        own = [one for one in found.verdict["findings"] if one["axis"] == change["axis"]]
        # what was there before, and what the written model could not hold, is no change
        own = [one for one in own if (one["axis"], one["effect"]) not in known]
        return {
            "verdict": found.verdict["verdict"],
            "findings": own,
            "model": str((folder / "after" / "model.toml").relative_to(self._out)),
            "report": str((folder / "after" / "report.html").relative_to(self._out)),
        }


def _profile(sense: Sense, one: Profile) -> dict[str, Any]:
    def numbers(values: Sequence[float]) -> list[float | None]:
        return [float(f"{v:.{DIGITS}g}") if math.isfinite(v) else None for v in values]

    sides = {"before": one.before, "after": one.after}
    return {
        "sense": sense.value,
        "coordinate": one.coordinate,
        "unit": one.unit,
        "centres": numbers(one.centres.tolist()),
        "labels": list(one.labels),
        "logarithmic": one.logarithmic,
        "by_direction": one.by_direction,
        **{
            name: {"mean": numbers(m.tolist()), "error": numbers(e.tolist())}
            for name, (m, e) in sides.items()
        },
    }
