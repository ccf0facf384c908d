"""Reconcile: recordings and a model in, what the model leaves out, and the repaired model into use."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.hmi.access import Role
from servo_ctrl.hmi.friction_view import duration_text
from servo_ctrl.hmi.notices import tell
from servo_ctrl.hmi.pages.reconcile_pick import Picker, counted
from servo_ctrl.hmi.pages.reconcile_result import Result
from servo_ctrl.hmi.parts import card, may, when_greeted
from servo_ctrl.hmi.reconcile_job import ENDED, Job, JobState
from servo_ctrl.hmi.reconcile_room import Room, room_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor

TITLE = "Reconcile"
SIGNS = {
    JobState.RUNNING: ("\N{BLACK RIGHT-POINTING TRIANGLE} running", "good"),
    JobState.CANCELLING: ("\N{HORIZONTAL ELLIPSIS} being cancelled", "warn"),
    JobState.DONE: ("\N{CHECK MARK} done", "good"),
    JobState.CANCELLED: ("\N{BLACK SQUARE} cancelled", "calm"),
    JobState.FAILED: ("\N{WARNING SIGN} failed", "bad"),
}
LINES_SHOWN = 8


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""
    room = room_of(bench.directories.recordings)

    def make(hello: Hello) -> Callable[[], None]:
        return Diagnosis(bench, visitor, hello, room).refresh

    when_greeted(bench, make)


class Diagnosis:
    """All of the page: what to pick, the run, and what came of it."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello, room: Room) -> None:
        self._bench, self._visitor, self._room = bench, visitor, room
        self._shown: Job | None = None
        self._newest: Job | None = None
        self._drawn: tuple[str, JobState] | None = None
        with ui.element("div").classes("bench-wide"):
            with ui.element("div").classes("bench-column"):
                Picker(bench, visitor, hello, room, self._started)
            self._run_card()
        self._result = Result(bench, visitor, hello, room)

    def _run_card(self) -> None:
        with card("Diagnosis", "diagnosis"):
            with ui.element("div").classes("bench-row apart"):
                self._state = ui.label().classes("bench-pill calm").mark("job-state")
                self._state.props("role=status aria-live=polite")
                self._time = ui.label().classes("num bench-faint").mark("job-time")
            self._bar = ui.linear_progress(0.0, show_value=False, size="14px").mark("job-progress")
            self._bar.props('aria-label="Progress of the diagnosis" animation-speed=200')
            self._step = ui.label().mark("job-step").style("overflow-wrap: anywhere")
            self._reason = ui.label().classes("bench-note warn").mark("job-reason").props("role=alert")
            self._reason.style("overflow-wrap: anywhere")
            self._lines = ui.label().classes("bench-faint").mark("job-lines")
            self._lines.style("white-space: pre-wrap; overflow-wrap: anywhere; font-size: 12px")
            with ui.element("div").classes("bench-row"):
                self._cancel = ui.button("Cancel", icon="stop", on_click=self._cancel_job).props("outline")
                self._cancel.mark("job-cancel")
            self._others = ui.element("div").classes("bench-column").mark("jobs")

    def refresh(self) -> None:
        """Show how far the diagnosis is, and what came of it once it has ended."""
        jobs = self._room.diagnoses.jobs
        if jobs and jobs[-1] is not self._newest:  # whoever has started it
            self._newest = self._shown = jobs[-1]
        job = self._shown
        self._cancel.set_visibility(self._room.diagnoses.running is not None)
        self._bar.set_visibility(job is not None)
        if job is None:
            self._state.set_text("none yet")
            self._reason.set_visibility(False)
            return
        sign, tone = SIGNS[job.state]
        self._state.set_text(sign)
        self._state.classes(tone, remove=" ".join({"calm", "good", "warn", "bad"} - {tone}))
        self._time.set_text(f"{duration_text(job.elapsed_s)}, started by {job.who}")
        self._bar.set_value(round(job.progress, 3))
        self._step.set_text("" if job.state in ENDED else job.step)
        self._reason.set_text(job.reason)
        self._reason.set_visibility(bool(job.reason))
        self._lines.set_text("" if job.state is JobState.DONE else "\n".join(job.lines[-LINES_SHOWN:]))
        if (job.key, job.state) != self._drawn:
            self._drawn = (job.key, job.state)
            self._show_others()
            self._result.show(job if job.state is JobState.DONE else None)

    def _show_others(self) -> None:
        self._others.clear()
        others = [job for job in reversed(self._room.diagnoses.jobs) if job is not self._shown]
        with self._others:
            for job in others:
                text = f"{job.started:%Y-%m-%d %H:%M} {job.state}, {counted(len(job.recordings))}"
                ui.button(text, on_click=partial(self._open, job)).props("flat align=left dense")

    def _open(self, job: Job) -> None:
        self._shown = job
        self.refresh()

    async def _started(self, recordings: list[Path], model: Path) -> None:
        if not may(self._bench, self._visitor, Role.OPERATE):
            return
        try:
            await self._room.start(recordings, model, self._visitor.who)
        except (ServoCtrlError, OSError) as error:
            tell(str(error))
        self.refresh()

    async def _cancel_job(self) -> None:
        if may(self._bench, self._visitor, Role.OPERATE):
            await self._room.cancel(self._visitor.who)
