"""What a diagnosis has found: verdict, findings, before and after, the report, and the model into use."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.hmi.access import Role
from servo_ctrl.hmi.notices import tell
from servo_ctrl.hmi.palette import lines
from servo_ctrl.hmi.parts import Table, card, confirmed, may
from servo_ctrl.hmi.plot_frame import figure_of, layout_of
from servo_ctrl.hmi.reconcile_job_verdict import (
    WORDS,
    Finding,
    Improvement,
    improvements,
    parameter_name,
    parameter_text,
    percent,
    read_verdict,
    title,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.reconcile_job import Job
    from servo_ctrl.hmi.reconcile_job_verdict import Verdict
    from servo_ctrl.hmi.reconcile_room import Room

STAGES = ("nominal", "refitted", "with the effects")
REPORT_HEIGHT_PX = 900
FILL_FRAME = """
const frame = getHtmlElement(%(frame)d);
fetch(%(address)s)
  .then((answer) => answer.text().then((text) => answer.ok ? text : Promise.reject(text)))
  .then((text) => { frame.srcdoc = text; })
  .catch((reason) => { frame.srcdoc = "The report cannot be read: " + reason; });
"""
"""The report is not the frame's address: no page of ours may be framed, and this one is none."""


class Result:
    """The lower half of the page; empty until a diagnosis is done."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello, room: Room) -> None:
        self._bench, self._visitor, self._room = bench, visitor, room
        self._proposed = Path(hello.machine_file).parent / "model_repaired.toml"
        self._place = ui.element("div").classes("bench-column").mark("result")
        self._job: Job | None = None

    def show(self, job: Job | None) -> None:
        """Show what this one has left; None: nothing."""
        self._job = job
        self._place.clear()
        if job is not None:
            with self._place:
                ui.timer(0.0, self._fill, once=True)

    async def _fill(self) -> None:
        job = self._job
        if job is None:
            return
        try:
            verdict = await run.io_bound(read_verdict, job.directory / "verdict.json")
        except ServoCtrlError as error:
            with self._place:
                ui.label(str(error)).classes("bench-note bad").mark("verdict-problem")
            return
        if verdict is None or job is not self._job:
            return
        with self._place:
            self._verdict(verdict, job)
            self._accept(job)
            self._report(job)

    def _verdict(self, verdict: Verdict, job: Job) -> None:
        sentence, advice = WORDS[verdict.verdict]
        with card("Verdict", "verdict"):
            ui.label(sentence).mark("verdict-sentence").style("font-size: 18px; font-weight: 600")
            ui.label(f"{advice} ({verdict.verdict})").mark("verdict-word")
            for finding in verdict.findings:
                _show_finding(finding)
            rows = list(improvements(verdict))
            if rows:
                ui.label("RMS of what the model misses, on stretches that it was not fitted to").classes(
                    "bench-faint"
                )
                Table("fit", ("axis", "in", "unit", *STAGES)).show(
                    [
                        (row.axis, row.sense, row.unit, *(f"{level:.3g}" for level in levels_of(row)))
                        for row in rows
                    ]
                )
                figure = fit_figure(rows, dark=self._visitor.dark)
                ui.plotly(figure).mark("fit-plot").style("width: 100%; height: 280px")
            for note in verdict.notes:
                ui.label(note).classes("bench-faint").style("overflow-wrap: anywhere; font-size: 12px")
            ui.label(f"Files: {job.directory}").classes("bench-faint").style("overflow-wrap: anywhere")

    def _accept(self, job: Job) -> None:
        with card("Use the repaired model", "accept"):
            ui.label("It is copied to this place on the controller; a file that is there is kept beside it.")
            with ui.element("div").classes("bench-row"):
                self._target = ui.input("file", value=str(self._proposed)).mark("accept-target")
                self._target.props("outlined dense").style("flex: 1 1 260px")
                button = ui.button("Accept model", icon="task_alt", on_click=lambda: self._take(job))
                button.props("unelevated").mark("accept-model").set_enabled(
                    self._visitor.role >= Role.CONFIGURE
                )
            self._said = ui.label().classes("bench-note").mark("accepted").props("role=status")
            self._said.set_visibility(False)
            if self._visitor.role < Role.CONFIGURE:
                ui.label("This needs the role configure.").classes("bench-faint")

    async def _take(self, job: Job) -> None:
        target = Path(str(self._target.value or "").strip())
        if not may(self._bench, self._visitor, Role.CONFIGURE):
            return
        if not target.is_absolute():
            target = self._proposed.parent.resolve() / target
        there = await run.io_bound(target.exists)
        details = f"{target}\n" + (
            "There is a file. It is kept under another name beside it." if there else "There is no file yet."
        )
        if not await confirmed("Use the repaired model?", details, "Accept"):
            return
        try:
            kept = await self._room.accept(job, target, self._visitor.who)
        except (ServoCtrlError, OSError) as error:
            tell(str(error), "negative")
            return
        old = f" The old one is {kept.name}." if kept is not None else ""
        self._said.set_text(f"{target} is the repaired model now.{old}")
        self._said.set_visibility(True)

    def _report(self, job: Job) -> None:
        with card("Report", "report"):
            frame = ui.element("iframe").mark("report-frame")
            # without allow-same-origin the report has no rights here: it cannot reach the machine
            frame.props('sandbox="allow-scripts" title="Report of the diagnosis"')
            frame.style(f"width: 100%; height: {REPORT_HEIGHT_PX}px; border: 0; background: white")
            address = json.dumps(self._room.address(job, "report.html"))
            ui.run_javascript(FILL_FRAME % {"frame": frame.id, "address": address})
            with ui.element("div").classes("bench-row"):
                for name in ("report.html", "verdict.json", "model.toml"):
                    ui.link(name, self._room.address(job, name)).props("download").style("padding: 12px 8px")


def fit_figure(rows: Sequence[Improvement], *, dark: bool) -> dict[str, Any]:
    """Before and after as shares of the nominal model's error, so that all senses fit one plot."""
    colours = lines(dark=dark)
    names = [f"{row.axis}: {row.sense}" for row in rows]
    data = [
        {
            "type": "bar",
            "name": stage,
            "x": names,
            "y": [_share(levels_of(row)[place], row.before) for row in rows],
            "marker": {"color": colours[place], "pattern": {"shape": ("", "/", ".")[place]}},
        }
        for place, stage in enumerate(STAGES)
    ]
    layout = layout_of("", "% of the nominal model", dark=dark)
    layout["barmode"] = "group"
    return figure_of(data, layout, revision="fit")


def levels_of(row: Improvement) -> tuple[float, float, float]:
    """In the order of STAGES."""
    return row.before, row.refitted, row.after


def _share(value: float, of: float) -> float | None:
    return 100.0 * value / of if of > 0.0 and math.isfinite(value) and math.isfinite(of) else None


def _show_finding(finding: Finding) -> None:
    alike = f" (or {', '.join(map(title, finding.equivalent))})" if finding.equivalent else ""
    with ui.element("div").classes("bench-note").mark("finding"):
        with ui.element("b"):
            ui.label(f"Axis {finding.axis}: {title(finding.effect)}{alike}")
        ui.label(f"confidence {percent(finding.confidence)}").classes("num")
        ui.label(finding.explanation)
        if finding.parameters:
            values = [
                f"{parameter_name(key)}: {parameter_text(value)}" for key, value in finding.parameters.items()
            ]
            ui.label("; ".join(values)).classes("bench-faint num").style("overflow-wrap: anywhere")
        for rival in finding.runners_up[:3]:
            ui.label(f"not {title(rival.effect)}: {rival.why_not}").classes("bench-faint")
