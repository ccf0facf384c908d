"""The program in the machine: loading, start, hold, resume, abort, and how far it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from nicegui import ui

from servo_ctrl.hmi.bench import ask
from servo_ctrl.hmi.parts import card

if TYPE_CHECKING:
    from servo_ctrl.config.local_status import ProgramState, Status
    from servo_ctrl.hmi.bench import Bench, Visitor


class Draft(NamedTuple):
    """The program of the editor, checked."""

    name: str
    text: str


class ProgramRun:
    """The card of what runs."""

    def __init__(self, bench: Bench, visitor: Visitor) -> None:
        self._bench, self._visitor = bench, visitor
        self._draft: Draft | None = None
        self._loaded: Draft | None = None
        with card("Program in the machine", "program-run"):
            with ui.element("div").classes("bench-row apart"):
                with ui.element("div").style("min-width: 0; flex: 1 1 260px"):
                    self._name = ui.label().style(
                        "font-size: 22px; font-weight: 600; overflow-wrap: anywhere"
                    )
                    self._name.mark("program-name")
                    self._step = ui.label().classes("bench-faint").mark("program-step")
                with ui.element("div").classes("bench-row bench-actions"):
                    self._load = self._button("Load", "upload", self._load_draft, "load-program")
                    self._start = self._button(
                        "Start", "play_arrow", lambda: self._ask("start_program"), "start"
                    )
                    self._hold = self._button("Hold", "pause", lambda: self._ask("hold_program"), "hold")
                    self._resume = self._button(
                        "Resume", "play_arrow", lambda: self._ask("resume_program"), "resume"
                    )
                    self._abort = self._button("Abort", "stop", lambda: self._ask("abort_program"), "abort")
            with ui.element("div").classes("bench-row").style("flex-wrap: nowrap"):
                self._bar = ui.linear_progress(0.0, show_value=False, size="14px").mark("progress")
                self._bar.props('rounded aria-label="Progress of the program"').style("flex: 1 1 auto")
                self._share = ui.label().classes("num").style("min-width: 5ch; text-align: right")
                self._share.mark("progress-share")
            self._problem = ui.label().classes("bench-note bad").props("role=alert").mark("program-problem")

    def _button(self, text: str, icon: str, action: object, mark: str) -> ui.button:
        button = ui.button(text, icon=icon, on_click=action).mark(mark)  # type: ignore[arg-type]
        return button.props("outline" if mark not in {"start", "resume"} else "unelevated")

    def offer(self, draft: Draft | None) -> None:
        """What Load would load; None while the editor's program is not well."""
        self._draft = draft

    def refresh(self, status: Status) -> None:
        """Show the machine's program, and what can be done with it now."""
        program, stage = status.program, status.stage
        running = stage == "running"
        self._name.set_text(program.name or "no program")
        self._step.set_text(_where(program, stage))
        self._bar.set_value(program.progress)
        self._share.set_text(f"{100.0 * program.progress:.0f} %")
        self._problem.set_text(program.problem)
        self._problem.set_visibility(bool(program.problem))
        new = self._draft is not None and self._draft != self._loaded
        self._load.set_enabled(new and stage in {"ready", "standby"} and not program.preparing)
        self._start.set_enabled(stage == "ready" and program.loaded and not program.preparing)
        self._hold.set_enabled(running and not program.held)
        self._resume.set_enabled(running and program.held)
        self._resume.set_visibility(program.held)
        self._start.set_visibility(not program.held)
        self._abort.set_enabled(running)

    async def _ask(self, command: str) -> None:
        await ask(self._bench, self._visitor, "command", command=command)

    async def _load_draft(self) -> None:
        draft = self._draft
        if draft is not None:
            answer = await ask(self._bench, self._visitor, "load_program", program=draft._asdict())
            if answer is not None and answer.accepted:
                self._loaded = draft


def _where(program: ProgramState, stage: str) -> str:
    if program.preparing:
        return "is being checked \N{HORIZONTAL ELLIPSIS}"
    if program.held:
        return f'held in step {program.step + 1} "{program.label}"'
    if stage == "running" and program.step >= 0:
        return f'step {program.step + 1} "{program.label}"'
    return "can be started" if program.loaded else "pick one below and load it"
