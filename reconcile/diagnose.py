"""`reconcile diagnose`: recordings and a model in, a verdict and a repaired model out."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.catalogue.kinds import Sense
from reconcile.evidence import Rules
from reconcile.explain import explain
from reconcile.model_file import load_model, write_model
from reconcile.next_experiment import NOTHING, next_experiment
from reconcile.next_experiment_program import write_program
from reconcile.recording import ReadOptions, load_recordings
from reconcile.repairs_whole import repair_whole
from reconcile.replay_controller import load_controllers
from reconcile.replay_models import loop_of, replay_models
from reconcile.report import write_report
from reconcile.sensing import examine
from reconcile.verdict import verdict
from reconcile.views import views
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from reconcile.explain import Explanation
    from reconcile.next_experiment import Asked
    from reconcile.next_experiment_limits import Limits
    from reconcile.views import View


class Diagnosis(NamedTuple):
    """What was written."""

    verdict: dict[str, Any]
    verdict_file: Path
    model_file: Path
    explanations: dict[str, list[Explanation]]
    """By axis: what each of its differences holds."""
    views: list[View]
    """What is seen of each difference."""
    report_file: Path | None
    """None where it was not wanted."""
    asked: Asked
    """The next experiment; of no motion where none was wanted."""


def diagnose(
    paths: Sequence[Path],
    model_file: Path,
    out: Path,
    options: ReadOptions | None = None,
    on_progress: Callable[[str], None] = lambda _text: None,
    *,
    with_report: bool = True,
    with_next: bool = True,
    limits: Mapping[str, Limits] | None = None,
    made: Sequence[str] = (),
) -> Diagnosis:
    """Read, check, explain each axis, write verdict.json, model.toml, report.html. Raises ReconcileError.

    `limits`: of the machine, for the next experiment; `made`: kinds of motions that were asked for before.
    """
    model = load_model(model_file)
    controllers = load_controllers(model.file)
    on_progress("reading")
    given = load_recordings(paths, model.axes, options)
    on_progress("checking timing and sensors")
    report = examine(given, model.axes)
    explanations: dict[str, list[Explanation]] = {}
    repairs, notes = {}, [str(finding) for finding in report.findings]
    for name, axis in model.axes.items():
        recordings = [recording for recording in report.recordings if recording.axis == name]
        if not recordings:
            continue
        on_progress(f"axis {name}: force")
        found = [explain(recordings, axis, Sense.FORCE, Rules())]
        with_scale = [recording for recording in recordings if recording.scale_m is not None]
        if with_scale:
            on_progress(f"axis {name}: scale less motor")
            found.append(explain(with_scale, axis, Sense.DEVIATION, Rules(least_gain=0.2)))
        repaired = repair_whole(found, model, name)
        explanations[name] = repaired.explanations
        repairs[name] = repaired.sections
        notes += repaired.notes
    if controllers:
        on_progress("replaying")
    loops = {
        name: loop_of(known, explanations[name])
        for name, known in controllers.items()
        if name in explanations
    }
    replayed = replay_models(report.recordings, model, repairs, loops)
    notes += replayed.notes
    on_progress("locating")
    seen = views(explanations, model.axes)
    asked = next_experiment(explanations, model.axes, limits, made) if with_next else NOTHING
    content = verdict(explanations, seen, notes=notes, replayed=replayed.done, following=asked.content)
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(content, indent=1) + "\n"
    file, plant = out / "verdict.json", out / "model.toml"
    write_whole(file, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    write_program(asked, out)
    write_whole(plant, lambda temporary: write_model(model, repairs, temporary))
    page = out / "report.html" if with_report else None
    if page is not None:
        on_progress("report")
        write_report(content, seen, page, replayed.done)
    return Diagnosis(content, file, plant, explanations, seen, page, asked)
