"""`reconcile diagnose`: from recordings and a model to a verdict, an updated model and a report."""

import json
from collections.abc import Callable, Container, Sequence
from collections.abc import Mapping as ByName
from pathlib import Path
from typing import Any, NamedTuple

from kernels.compiler_memory import release_compiler
from reconcile.design.limits import AxisLimits
from reconcile.design.next_experiment import NOTHING, NextExperiment, next_experiment
from reconcile.design.program import write_program
from reconcile.diagnosis.axis_diagnosis import diagnose_axis
from reconcile.diagnosis.verdict import verdict
from reconcile.formats.mapping import NO_MAPPING, Mapping
from reconcile.formats.rotary_units import sentence_of
from reconcile.identification.explain import Explanation
from reconcile.location.residual_analysis import ResidualAnalysis, residual_analyses
from reconcile.model_update.shared_values import Sections
from reconcile.nominal_model.model_file import NominalModel, load_model, write_model
from reconcile.proof.proof import Proof
from reconcile.recording.recording import AxisRecording, load_recordings
from reconcile.recording.sensor_finding import SensorFinding, notes_of
from reconcile.regression.thinning import to_be_thinned
from reconcile.replay.controller import load_controllers
from reconcile.replay.model_replays import control_loop, replay_models
from reconcile.report.report import write_report
from reconcile.selection.selection_rules import SelectionRules
from reconcile.sensing.checks import examine
from servo_ctrl.files.diagnosis_files import MODEL_FILE, REPORT_FILE, VERDICT_FILE
from servo_ctrl.files.whole_file import write_text_whole, write_whole


class WrittenDiagnosis(NamedTuple):
    """Results of a diagnosis, and the files that were written."""

    verdict: dict[str, Any]
    verdict_file: Path
    model_file: Path
    explanations: dict[str, list[Explanation]]
    """By axis, one for each residual channel."""
    residual_analyses: list[ResidualAnalysis]
    """What figures and locations are made of, one for each channel of each axis."""
    report_file: Path | None
    """None without a report."""
    next_experiment: NextExperiment
    """Empty where none was wanted."""


def diagnose(
    paths: Sequence[Path],
    model_file: Path,
    out: Path,
    mapping: Mapping = NO_MAPPING,
    on_progress: Callable[[str], None] = lambda _text: None,
    *,
    with_report: bool = True,
    with_next: bool = True,
    with_proof: bool = True,
    set_aside: bool = True,
    negligible_force_share: float = SelectionRules().negligible_force_share,
    limits: ByName[str, AxisLimits] | None = None,
    made: Sequence[str] = (),
) -> WrittenDiagnosis:
    """Read, check and explain each axis; write verdict.json, model.toml, report.html. Raises ReconcileError.

    The next experiment stays within `limits` by axis; `made` are the kinds of motions made so far. With a
    proof each recording is left out in turn. Files that cannot be read are set aside, or else raise. Below
    `negligible_force_share`, a share of the force, no effect is named.
    """
    model = load_model(model_file)
    controllers = load_controllers(model.file)
    usable = _usable_recordings(
        paths, model, mapping, on_progress, at_full_rate=controllers, set_aside=set_aside
    )
    explained = _explain_axes(usable, model, negligible_force_share, on_progress, with_proof=with_proof)
    if controllers:
        on_progress("replaying")
    loops = {
        name: control_loop(controllers[name], explained.explanations[name])
        for name in controllers
        if name in explained.explanations
    }
    replayed = replay_models(usable.at_full_rate, model, explained.updates, loops)
    on_progress("locating")
    analyses = residual_analyses(explained.explanations, model.axes)
    following = next_experiment(explained.explanations, model.axes, limits, made) if with_next else NOTHING
    content = verdict(
        explained.explanations,
        analyses,
        notes=[*usable.notes, *explained.notes, *replayed.notes],
        replayed=replayed.comparisons,
        proofs=explained.proofs,
        following=following.content,
    )
    out.mkdir(parents=True, exist_ok=True)
    write_text_whole(out / VERDICT_FILE, json.dumps(content, indent=1) + "\n")
    write_program(following.program, following.content.get("why", ""), out)
    write_whole(out / MODEL_FILE, lambda temporary: write_model(model, explained.updates, temporary))
    page = out / REPORT_FILE if with_report else None
    if page is not None:
        on_progress("report")
        write_report(content, analyses, page, replayed.comparisons)
    return WrittenDiagnosis(
        verdict=content,
        verdict_file=out / VERDICT_FILE,
        model_file=out / MODEL_FILE,
        explanations=explained.explanations,
        residual_analyses=analyses,
        report_file=page,
        next_experiment=following,
    )


class _UsableRecordings(NamedTuple):
    """What the checks of timing and sensors have left to explain."""

    by_axis: dict[str, tuple[list[AxisRecording], list[SensorFinding]]]
    """At most as many samples as memory allows, and the notes about that; without axes that have none."""
    at_full_rate: list[AxisRecording]
    """Of the axes that are replayed."""
    notes: list[str]


def _usable_recordings(
    paths: Sequence[Path],
    model: NominalModel,
    mapping: Mapping,
    on_progress: Callable[[str], None],
    *,
    at_full_rate: Container[str],
    set_aside: bool,
) -> _UsableRecordings:
    """Read and check the recordings; the others are released, because the columns need their memory.

    `at_full_rate`: axes whose recordings are needed with all samples too.
    """
    on_progress("reading")
    loaded = load_recordings(paths, model.axes, mapping, set_aside=set_aside)
    on_progress("checking timing and sensors")
    checked = examine(loaded, model.axes)
    by_axis = {name: [one for one in checked.recordings if one.axis == name] for name in model.axes}
    return _UsableRecordings(
        {name: to_be_thinned(of) for name, of in by_axis.items() if of},
        [one for one in checked.recordings if one.axis in at_full_rate],
        notes_of(checked.findings),
    )


class _ExplainedAxes(NamedTuple):
    """The diagnoses of all axes."""

    explanations: dict[str, list[Explanation]]
    """By axis, as all of these are; one for each residual channel."""
    proofs: dict[str, list[Proof]]
    updates: dict[str, Sections]
    """Sections of the model file."""
    notes: list[str]


def _explain_axes(
    usable: _UsableRecordings,
    model: NominalModel,
    negligible_force_share: float,
    on_progress: Callable[[str], None],
    *,
    with_proof: bool,
) -> _ExplainedAxes:
    """Diagnose one axis after the other."""
    explained = _ExplainedAxes({}, {}, {}, [])
    for name, (recordings, thinning) in usable.by_axis.items():
        release_compiler()  # its 68 MB, which loading kernels has touched, are for the columns
        one = diagnose_axis(recordings, model, negligible_force_share, on_progress, with_proof=with_proof)
        explained.explanations[name], explained.proofs[name] = one.explanations, one.proofs
        explained.updates[name] = one.sections
        explained.notes.extend(notes_of(thinning))
        explained.notes.extend(sentence_of(note, rotary=model.axes[name].rotary) for note in one.notes)
    return explained
