"""The card of the program in the machine: load, start, hold, resume, abort, and its progress."""

from collections.abc import Sequence
from functools import partial

from nicegui import ui

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.learning_status import ACTIVE
from servo_ctrl.commands.local_messages import ProgramText
from servo_ctrl.commands.machine_status import MachineStatus, ProgramStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.motion.pace_controls import PaceControls
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.live_elements import LiveLabel
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import (
    ButtonLook,
    button,
    card,
    confirmed,
    div,
    faint,
    named,
    note,
    progress_bar,
)

BUTTONS: dict[Command, tuple[str, str, ButtonLook]] = {
    Command.START_PROGRAM: (word("Start"), "play_arrow", "unelevated"),
    Command.HOLD_PROGRAM: (word("Hold"), "pause", "outline"),
    Command.RESUME_PROGRAM: (word("Resume"), "play_arrow", "unelevated"),
    Command.ABORT_PROGRAM: (word("Abort"), "stop", "outline"),
}
LEARNS = word("the machine is learning: pause or abort that on page Friction")


class ProgramRun:
    """The card of the program that runs or can be started."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._draft: ProgramText | None = None
        self._loaded: ProgramText | None = None
        with card(tr("Program in the machine"), "program-run"):
            with div("bench-row apart"):
                with div().style("min-width: 0; flex: 1 1 260px"):
                    self._name = ui.label().mark("program-name")
                    self._name.style("font-size: 22px; font-weight: 600; overflow-wrap: anywhere")
                    self._step = faint().mark("program-step")
                with div("bench-row bench-actions"):
                    self._load = button(tr("Load"), self._load_draft, "load-program", icon="upload")
                    self._buttons = {
                        command: button(
                            tr(text),
                            self._ask_start
                            if command is Command.START_PROGRAM
                            else partial(page.command, command),
                            command.name.lower().removesuffix("_program"),
                            icon=icon,
                            look=look,
                        )
                        for command, (text, icon, look) in BUTTONS.items()
                    }
            with div("bench-row").style("flex-wrap: nowrap"):
                self._bar = progress_bar(tr("Progress of the program"), "progress")
                self._bar.style("flex: 1 1 auto")
                self._percent = LiveLabel().classes("num").mark("progress-share")
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
        self._name.set_text(program.name or tr("no program"))
        self._step.set_text(tr(LEARNS) if learning else step_text(program, stage))
        self._bar.set_share(program.progress)
        self._percent.set_text(f"{100.0 * program.progress:.0f} %")
        self._problem.set_text(controller_text(program.problem))
        self._pace.refresh(status)
        known = self._loaded is not None and self._loaded.name == program.name and not program.apart
        self._lines.show(self._loaded.text if known and self._loaded is not None else "", program.line)
        offer(self._page, [self._load], status, "load_program", own=self._nothing_to_load())
        for command, element in self._buttons.items():
            offer(self._page, [element], status, command)
        self._buttons[Command.RESUME_PROGRAM].set_visibility(program.held)
        self._buttons[Command.START_PROGRAM].set_visibility(not program.held)

    def _nothing_to_load(self) -> str:
        if self._draft is None:
            return tr("There is no program below that is checked and within the limits.")
        return tr("The machine has this program already.") if self._draft == self._loaded else ""

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
    """Return how far the program is, or what is missing before it can be started."""
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


AROUND = 3
"""Lines before and behind; chosen."""


class LineView:
    """Hidden while no line is under way."""

    def __init__(self) -> None:
        self._place = div("bench-lines num").mark("line-under-way")
        named(self._place, tr("Line under way"))
        self._view = Rebuilt(self._place, _show)

    def show(self, text: str, line: int) -> None:
        """Show the surroundings of a line, from 1; 0 = none is under way."""
        shown = lines_around(text, line)
        self._place.set_visibility(bool(shown))
        self._view.show(shown)


def lines_around(text: str, line: int) -> tuple[tuple[int, str, bool], ...]:
    """Number and text of the lines around this one, and whether it is the one."""
    lines = text.split("\n")
    if not 1 <= line <= len(lines):
        return ()
    first, last = max(line - AROUND, 1), min(line + AROUND, len(lines))
    return tuple((number, lines[number - 1][:200], number == line) for number in range(first, last + 1))


def _show(lines: Sequence[tuple[int, str, bool]]) -> None:
    for number, text, under_way in lines:
        with div("here" if under_way else "") as row:
            if under_way:
                row.props("aria-current=step")
            ui.label(f"{'▶' if under_way else ''} {number}")
            ui.label(text)
