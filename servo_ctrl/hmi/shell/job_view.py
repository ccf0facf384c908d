"""The running or a chosen job on a page: its state, its progress and its last lines, and how to cancel it."""

from collections.abc import Awaitable, Callable

from nicegui import ui

from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.live_elements import LiveLabel
from servo_ctrl.hmi.shell.machine_stage import Tone
from servo_ctrl.hmi.shell.parts import Pill, button, div, faint, note, progress_bar
from servo_ctrl.hmi.shell.program_jobs import ENDED, Job, JobState
from servo_ctrl.hmi.shell.units import duration_text

STATES: dict[JobState, tuple[str, Tone]] = {
    JobState.RUNNING: (word("\N{BLACK RIGHT-POINTING TRIANGLE} running"), "good"),
    JobState.CANCELLING: (word("… being cancelled"), "warn"),
    JobState.DONE: (word("✓ done"), "good"),
    JobState.CANCELLED: (word("\N{BLACK SQUARE} cancelled"), "calm"),
    JobState.FAILED: (word("⚠ failed"), "bad"),
}
SHOWN_LINES = 8
"""Bounds the last lines that are shown of a job that is running or has failed; chosen."""


class JobView:
    """What a page shows of a job; `step_text` puts a step into the language of the page."""

    def __init__(
        self, bar_label: str, step_text: Callable[[str], str], cancel: Callable[[], Awaitable[None]]
    ) -> None:
        self._step_text = step_text
        with div("bench-row apart"):
            self._state = Pill("job-state")
            self._time = LiveLabel().classes("bench-faint num").mark("job-time")
        self._bar = progress_bar(bar_label, "job-progress")
        self._step = ui.label().mark("job-step").style("overflow-wrap: anywhere")
        self._reason = note("job-reason").props("role=alert")
        self._lines = faint().mark("job-lines")
        self._lines.style("white-space: pre-wrap; overflow-wrap: anywhere; font-size: 12px")
        with div("bench-row"):
            self._cancel_button = button(tr("Cancel"), cancel, "job-cancel", icon="stop")

    def show(self, job: Job | None, *, running: bool) -> None:
        """Show a job, None before the first; `running`: there is one to cancel."""
        self._cancel_button.set_visibility(running)
        self._bar.set_visibility(job is not None)
        if job is None:
            self._state.show(tr("none yet"), "calm")
            return
        shown, tone = STATES[job.state]
        self._state.show(tr(shown), tone)
        self._time.set_text(
            tr("{elapsed}, started by {who}", elapsed=duration_text(job.elapsed_s), who=job.who)
        )
        self._bar.set_share(job.progress)
        self._step.set_text("" if job.state in ENDED else self._step_text(tr(job.step)))
        self._reason.set_text(controller_text(job.reason))
        self._lines.set_text("" if job.state is JobState.DONE else "\n".join(job.lines[-SHOWN_LINES:]))
