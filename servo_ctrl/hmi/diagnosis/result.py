"""The result of a diagnosis: verdict, findings, residuals, the report, and the model to accept."""

import json
import math
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import run, ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.files.diagnosis_files import REPORT_FILE, VERDICT_FILE
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.diagnosis.diagnoses import Diagnoses
from servo_ctrl.hmi.diagnosis.job_files import MEDIA_TYPES
from servo_ctrl.hmi.diagnosis.verdict import (
    SENTENCES,
    DiagnosisVerdict,
    Finding,
    Improvement,
    effect_name,
    improvements,
    parameter_name,
    parameter_text,
    percent,
    read_verdict,
)
from servo_ctrl.hmi.languages.controller_messages import diagnosis_text
from servo_ctrl.hmi.languages.report_page import note_text
from servo_ctrl.hmi.languages.texts import tr, translated, word
from servo_ctrl.hmi.shell.live_content import TextTable
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import (
    button,
    card,
    confirmed,
    div,
    errors_notified,
    faint,
    note,
    problem_text,
)
from servo_ctrl.hmi.shell.plots import Theme, figure, plot_layout
from servo_ctrl.hmi.shell.program_jobs import Job

MODELS = (word("nominal"), word("refitted"), word("with the effects"))
"""The models whose residuals are compared, in the order of `Improvement.levels`."""
PATTERNS = ("", "/", ".")
"""Hatching of their bars, to tell them apart without colour too."""
OF_A_CURVE = re.compile(r"(at|height)_\d+")
"""Parameters that are the points of a curve."""
RIVALS_SHOWN = 3
"""Bounds the rivals that are listed for a finding; chosen."""
REPORT_HEIGHT_PX = 900
"""Height of the frame with the report, pixels; chosen."""
LOAD_REPORT = """
const frame = getHtmlElement(%(frame)d);
fetch(%(address)s)
  .then((answer) => answer.text().then((text) => answer.ok ? text : Promise.reject(text)))
  .then((text) => { frame.srcdoc = text; })
  .catch((reason) => { frame.srcdoc = "The report cannot be read: " + reason; });
"""
"""Puts the report into the frame as text: what our server answers must not be shown in a frame."""


class DiagnosisResult:
    """The lower half of the page; empty until a diagnosis is done."""

    def __init__(self, page: OpenPage, hello: Hello, diagnoses: Diagnoses) -> None:
        self._page, self._diagnoses = page, diagnoses
        self._proposed = Path(hello.machine_file).parent / "model_repaired.toml"
        self._place = div("bench-column").mark("result")
        self._job: Job | None = None

    def show(self, job: Job | None) -> None:
        """Show the result of a job; None: nothing."""
        self._job = job
        self._place.clear()
        if job is not None:
            with self._place:
                ui.timer(0.0, self._build, once=True)

    async def _build(self) -> None:
        job = self._job
        if job is None:
            return
        try:
            verdict = await run.io_bound(read_verdict, job.directory / VERDICT_FILE)
        except Exception as error:  # noqa: BLE001  # an empty result would look as if there had been no diagnosis
            with self._place:
                note("verdict-problem", "bad").set_text(problem_text(error))
            return
        if verdict is None or job is not self._job:
            return
        with self._place:
            self._build_verdict(verdict, job)
            self._build_acceptance(job)
            self._build_report(job)

    def _build_verdict(self, verdict: DiagnosisVerdict, job: Job) -> None:
        sentence, advice = SENTENCES[verdict.verdict]
        with card(tr("Verdict"), "verdict"):
            ui.label(tr(sentence)).mark("verdict-sentence").style("font-size: 18px; font-weight: 600")
            ui.label(f"{tr(advice)} ({verdict.verdict})").mark("verdict-word")
            for finding in verdict.findings:
                _show_finding(finding)
            rows = list(improvements(verdict))
            if rows:
                faint(tr("RMS of the residual on held-out blocks"))
                TextTable("fit", (tr("axis"), tr("in"), tr("unit"), *translated(MODELS))).show(
                    [(*row[:3], *(f"{level:.3g}" for level in row.levels)) for row in rows]
                )
                plot = ui.plotly(fit_figure(rows, self._page.look.theme)).mark("fit-plot")
                plot.style("width: 100%; height: 280px")
            for text in verdict.notes:
                faint(note_text(text)).style("overflow-wrap: anywhere; font-size: 12px")
            faint(tr("Files: {place}", place=job.directory)).style("overflow-wrap: anywhere")

    def _build_acceptance(self, job: Job) -> None:
        may_accept = self._page.role >= Role.CONFIGURE
        with card(tr("Use the repaired model"), "accept"):
            ui.label(
                tr("It is copied to this place on the controller; a file that is there is kept beside it.")
            )
            with div("bench-row"):
                self._target = ui.input(tr("file"), value=str(self._proposed)).mark("accept-target")
                self._target.style("flex: 1 1 260px")
                accept = partial(self._accept, job)
                use = button(tr("Accept model"), accept, "accept-model", icon="task_alt", look="unelevated")
                use.set_enabled(may_accept)
            self._accepted = note("accepted", "").props("role=status")
            if not may_accept:
                faint(tr("This needs the role configure."))

    async def _accept(self, job: Job) -> None:
        target = Path(str(self._target.value or "").strip())
        if not self._page.permits(Role.CONFIGURE):
            return
        target = self._proposed.parent.resolve() / target
        exists = await run.io_bound(target.exists)
        kept_text = tr("There is a file. It is kept under another name beside it.")
        details = f"{target}\n{kept_text if exists else tr('There is no file yet.')}"
        if not await confirmed(tr("Use the repaired model?"), details, tr("Accept")):
            return
        with errors_notified():
            kept = await self._diagnoses.accept(job, target, self._page.who)
            old = tr(" The old one is {name}.", name=kept.name) if kept is not None else ""
            self._accepted.set_text(tr("{target} is the repaired model now.{old}", target=target, old=old))

    def _build_report(self, job: Job) -> None:
        with card(tr("Report"), "report"):
            frame = ui.element("iframe").mark("report-frame")
            # without allow-same-origin the scripts of the report cannot use the rights of this page
            frame.props('sandbox="allow-scripts"')
            frame.props["title"] = tr("Report of the diagnosis")
            frame.style(f"width: 100%; height: {REPORT_HEIGHT_PX}px; border: 0; background: white")
            address = json.dumps(self._diagnoses.address(job, REPORT_FILE, self._page.language))
            ui.run_javascript(LOAD_REPORT % {"frame": frame.id, "address": address})
            with div("bench-row"):
                for name in MEDIA_TYPES:
                    link = ui.link(name, self._diagnoses.address(job, name, self._page.language))
                    link.props("download").style("padding: 12px 8px")


def fit_figure(rows: Sequence[Improvement], theme: Theme) -> dict[str, Any]:
    """Return the residuals in per cent of the nominal model's, so that all channels fit into one plot."""
    data = [
        {
            "type": "bar",
            "name": tr(model),
            "x": [f"{row.axis}: {row.channel}" for row in rows],
            "y": [_percent_of(row.levels[number], row.levels[0]) for row in rows],
            "marker": {"color": theme.curve(number), "pattern": {"shape": PATTERNS[number]}},
        }
        for number, model in enumerate(MODELS)
    ]
    layout = plot_layout("", tr("% of the nominal model"), theme) | {"barmode": "group"}
    return figure(data, layout, revision="fit")


def _percent_of(value: float, whole: float) -> float | None:
    known = whole > 0.0 and math.isfinite(value) and math.isfinite(whole)
    return 100.0 * value / whole if known else None


def _show_finding(finding: Finding) -> None:
    alike = (
        tr(" (or {effects})", effects=", ".join(map(_effect, finding.equivalent)))
        if finding.equivalent
        else ""
    )
    with div("bench-note").mark("finding"):
        with ui.element("b"):
            ui.label(
                tr(
                    "Axis {axis}: {effect}{alike}",
                    axis=finding.axis,
                    effect=_effect(finding.effect),
                    alike=alike,
                )
            )
        ui.label(tr("confidence {percent}", percent=percent(finding.confidence))).classes("num")
        ui.label(diagnosis_text(finding.explanation))
        shown = [
            f"{diagnosis_text(parameter_name(key))}: {parameter_text(one)}"
            for key, one in finding.parameters.items()
            if not OF_A_CURVE.fullmatch(key)
        ]
        if len(shown) < len(finding.parameters):
            shown.append(tr("its curve is drawn in the report"))
        if shown:
            faint("; ".join(shown)).classes("num").style("overflow-wrap: anywhere")
        for rival in finding.runners_up[:RIVALS_SHOWN]:
            why_not = diagnosis_text(rival.why_not)
            faint(tr("not {effect}: {why}", effect=_effect(rival.effect), why=why_not))


def _effect(name: str) -> str:
    """Return the name of an effect in the language of the page."""
    return diagnosis_text(effect_name(name))
