"""The editor of the Motion page: pick a program, fill in its form or write it; each change is checked."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.hmi.access import Role
from servo_ctrl.hmi.notices import tell
from servo_ctrl.hmi.pages.motion_run import Draft
from servo_ctrl.hmi.parts import card, confirmed, may
from servo_ctrl.hmi.program_check import preview_of
from servo_ctrl.hmi.program_files import programs_in, read_program, save_program
from servo_ctrl.hmi.program_form import StepForm

if TYPE_CHECKING:
    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.pages.motion_preview import PathPreview
    from servo_ctrl.hmi.pages.motion_run import ProgramRun

_CHECKS = asyncio.Semaphore(1)
"""One program is checked at a time in the whole process: STOP must not wait behind ten of them."""


class Editor:
    """The card of the program that is being edited."""

    def __init__(
        self, bench: Bench, visitor: Visitor, hello: Hello, run: ProgramRun, preview: PathPreview
    ) -> None:
        self._bench, self._visitor, self._run, self._preview = bench, visitor, run, preview
        self._machine_file = Path(hello.machine_file)
        self._directory = bench.directories.programs or self._machine_file.parent / "programs"
        self._name, self._text = "", ""
        self._number = 0
        with card("Program", "editor"):
            self._choice = ui.select([], label="from the programs directory", on_change=self._pick)
            self._choice.props("outlined dense options-dense").mark("program-choice")
            self._verdict = ui.label().classes("bench-note").props("role=status aria-live=polite")
            self._verdict.mark("program-verdict").style("overflow-wrap: anywhere")
            with ui.tabs().props("dense no-caps align=left") as tabs:
                self._as_form = ui.tab("Form").mark("tab-form")
                self._as_text = ui.tab("Text").mark("tab-text")
            with ui.tab_panels(tabs, value=self._as_form, animated=False).classes(
                "bench-panels"
            ) as self._panels:
                with ui.tab_panel(self._as_form):
                    self._form = StepForm([axis.name for axis in hello.axes], self._form_changed)
                    self._no_form = ui.label("This program can be edited as text only.").classes(
                        "bench-faint"
                    )
                with ui.tab_panel(self._as_text):
                    self._area = ui.textarea().props(
                        'outlined rows=24 spellcheck=false aria-label="Program text"'
                    )
                    self._area.mark("program-text").style("width: 100%")
                    self._area.on("change", self._text_changed)
            with ui.element("div").classes("bench-row"):
                self._save_name = ui.input("save as").props("outlined dense").mark("save-name")
                self._save_name.style("flex: 1 1 160px")
                ui.button("Save", icon="save", on_click=self._save).props("outline").mark("save-program")
        self._list(first=True)

    def _list(self, *, first: bool = False) -> None:
        names = programs_in(self._directory)
        running = self._bench.link.status.program.name if self._bench.link.status else ""
        chosen = running if first and running in names else self._name
        self._choice.set_options(names, value=chosen if chosen in names else None)

    async def _pick(self) -> None:
        name = self._choice.value
        if name is None or name == self._name:
            return
        try:
            text = await asyncio.to_thread(read_program, self._directory, name)
        except ServoCtrlError as error:
            tell(str(error), "negative")
            return
        self._name = name
        self._save_name.set_value(name)
        self._no_form.set_visibility(not self._form.show(text))
        self._area.set_value(text)
        await self._take(text)

    async def _text_changed(self) -> None:
        text = self._area.value or ""
        self._no_form.set_visibility(not self._form.show(text))
        await self._take(text)

    async def _form_changed(self, text: str) -> None:
        self._area.set_value(text)
        await self._take(text)

    async def _take(self, text: str) -> None:
        """Check a text; a later one may overtake it."""
        self._text = text
        self._number += 1
        number, name = self._number, self._name or "program.toml"
        self._run.offer(None)
        self._judge("is being checked \N{HORIZONTAL ELLIPSIS}", "")
        async with _CHECKS:
            if number != self._number:
                return
            try:
                preview = await asyncio.to_thread(preview_of, self._machine_file, name, text)
            except ServoCtrlError as error:
                if number == self._number:
                    self._preview.show(None)
                    self._judge(f"\N{HEAVY MULTIPLICATION X} {error}", "bad")
                return
        if number == self._number:
            self._preview.show(preview)
            self._run.offer(Draft(name, text))
            self._judge(f"\N{CHECK MARK} {name}: within the limits, from home", "")

    def _judge(self, verdict: str, tone: str) -> None:
        self._verdict.set_text(verdict)
        self._verdict.classes(tone, remove="bad" if not tone else "")

    async def _save(self) -> None:
        name = (self._save_name.value or "").strip()
        if not may(self._bench, self._visitor, Role.OPERATE):
            return
        exists = name in programs_in(self._directory)
        if exists and not await confirmed(f"Replace {name}?", "The file of that name is lost.", "Replace"):
            return
        try:
            await asyncio.to_thread(save_program, self._directory, name, self._text)
        except ServoCtrlError as error:
            tell(str(error), "negative")
            return
        self._name = name
        self._list()
        tell(f"{name} is saved.", "positive")
        await self._take(self._text)
