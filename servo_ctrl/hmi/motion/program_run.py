"""The card of the program in the machine: load, start, hold, resume, abort, and its progress."""

from functools import partial

from nicegui import ui

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.learning_status import ACTIVE
from servo_ctrl.commands.local_messages import ProgramText
from servo_ctrl.commands.machine_status import MachineStatus, ProgramStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.motion.line_view import LineView
from servo_ctrl.hmi.motion.pace_controls import PaceControls
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import (
    button,
    card,
    confirmed,
    div,
    faint,
    note,
    progress_bar,
)

LEARNS = word("the machine is learning: pause or abort that on page Friction")


class ProgramRun:
    """The card of the program that runs or can be started."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._draft: ProgramText | None = None
        self._loaded: ProgramText | None = None
        hold, resume, abort = (
            partial(page.command, Command[f"{verb}_PROGRAM"]) for verb in ("HOLD", "RESUME", "ABORT")
        )
        with card(tr("Program in the machine"), "program-run"):
            with div("bench-row apart"):
                with div().style("min-width: 0; flex: 1 1 260px"):
                    self._name = ui.label().mark("program-name")
                    self._name.style("font-size: 22px; font-weight: 600; overflow-wrap: anywhere")
                    self._step = faint().mark("program-step")
                with div("bench-row bench-actions"):
                    self._load = button(tr("Load"), self._load_draft, "load-program", icon="upload")
                    self._start = button(
                        tr("Start"), self._ask_start, "start", icon="play_arrow", look="unelevated"
                    )
                    self._hold = button(tr("Hold"), hold, "hold", icon="pause")
                    self._resume = button(
                        tr("Resume"), resume, "resume", icon="play_arrow", look="unelevated"
                    )
                    self._abort = button(tr("Abort"), abort, "abort", icon="stop")
            with div("bench-row").style("flex-wrap: nowrap"):
                self._bar = progress_bar(tr("Progress of the program"), "progress")
                self._bar.props("rounded").style("flex: 1 1 auto")
                self._percent = ui.label().classes("num").mark("progress-share")
                self._percent.style("min-width: 5ch; text-align: right")
            self._pace = PaceControls(page)
            self._lines = LineView()
            self._problem = note("program-problem", "bad").props("role=alert")

    def offer(self, draft: ProgramText | None) -> None:
        """Set the program that Load sends; None while the editor's program is not checked or not valid."""
        self._draft = draft

    def refresh(self, status: MachineStatus) -> None:
        """Show the program of the machine, and enable what is possible now."""
        program, stage = status.program, status.stage
        learning = status.learning.state in ACTIVE
        running = stage is Stage.RUNNING and not learning
        self._name.set_text(program.name or tr("no program"))
        self._step.set_text(tr(LEARNS) if learning else step_text(program, stage))
        self._bar.set_value(program.progress)
        self._percent.set_text(f"{100.0 * program.progress:.0f} %")
        self._problem.set_text(controller_text(program.problem))
        self._pace.refresh(status)
        known = self._loaded is not None and self._loaded.name == program.name and not program.apart
        self._lines.show(self._loaded.text if known and self._loaded is not None else "", program.line)
        changed = self._draft is not None and self._draft != self._loaded
        self._load.set_enabled(changed and stage in {Stage.READY, Stage.STANDBY} and not program.preparing)
        self._start.set_enabled(
            stage is Stage.READY and program.loaded and not program.preparing and not learning
        )
        self._hold.set_enabled(running and not program.held)
        self._resume.set_enabled(running and program.held)
        self._resume.set_visibility(program.held)
        self._start.set_visibility(not program.held)
        self._abort.set_enabled(running)

    async def _ask_start(self) -> None:
        """Start; where the program is entered behind its first line, show what holds there first."""
        status = self._page.link.status
        entry = status.program.entry if status is not None else ""
        details = tr(
            "{entry}\nThe axes go first, straight and as a rapid move, to where the line before ends.",
            entry=entry,
        )
        if not entry or await confirmed(tr("Start behind the first line?"), details, tr("Start")):
            await self._page.command(Command.START_PROGRAM)

    async def _load_draft(self) -> None:
        draft = self._draft
        if draft is not None:
            answer = await self._page.ask("load_program", program=draft)
            if answer is not None and answer.accepted:
                self._loaded = draft


def step_text(program: ProgramStatus, stage: Stage) -> str:
    """How far the program is, or what is missing before it can be started."""
    if program.preparing:
        return tr("is being checked …")
    line = tr(", line {line}", line=program.line) if program.line else ""
    if program.held:
        why = f" ({controller_text(program.held_by)})" if program.held_by else ""
        return tr(
            'held in step {step} "{label}"{line}{why}',
            step=program.step + 1,
            label=program.label,
            line=line,
            why=why,
        )
    if stage is Stage.RUNNING and program.step >= 0:
        what = tr("a line of its own") if program.apart else tr("step {step}", step=program.step + 1)
        return f'{what} "{program.label}"{line}'
    if not program.loaded:
        return tr("pick one below and load it")
    if stage is Stage.READY:
        return tr("can be started")
    return tr("is loaded; it can be started once the drives are on: Enable on page Drive")
