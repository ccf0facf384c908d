"""PySINDy beside reconcile, same files, same scoring: `reconcile trial --beside` this module."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from reconcile.catalogue.registry import ENTRIES
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.sensing.checks import examine
from tests.campaigns.bench import sindy_peer
from tests.campaigns.bench.reconcile_score import finding

NAME = f"PySINDy {version('pysindy')}"


def answer(recordings: Sequence[Path], model_file: Path) -> dict[str, Any]:
    """Verdict and findings, the strongest first; of equivalents it knows the catalogue's.

    `left`: by axis and sense, the RMS on the blocks that it holds out, over that of the refitted model.
    """
    model = load_model(model_file)
    report = examine(load_recordings(recordings, model.axes), model.axes)
    found: list[dict[str, Any]] = []
    left: dict[str, dict[str, float]] = {}
    level: dict[str, dict[str, float]] = {}
    for name, axis in model.axes.items():
        own = [recording for recording in report.recordings if recording.axis == name]
        if not own:
            continue
        peer = sindy_peer.diagnose(own, axis)
        found += [finding(name, effect, ENTRIES[effect].equivalent, share) for effect, share in peer.named]
        left[name] = {channel: held.after / held.refitted for channel, held in peer.held_out.items()}
        level[name] = {channel: held.after for channel, held in peer.held_out.items()}
    found.sort(key=lambda one: -float(one["heldout_gain"]))
    return {"verdict": "effects" if found else "consistent", "findings": found, "left": left, "level": level}
