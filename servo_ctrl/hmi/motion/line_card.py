"""The card for single lines of G-code (MDI): what holds, a field, and the lines that were sent before."""

from functools import partial

from nicegui import ui

from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.live_content import Rebuilt
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, div, faint

KEPT = 8
"""Lines that are offered again; chosen."""


class LineCard:
    """One line at a time, run from where the axes stand."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._sent: tuple[str, ...] = ()
        with card(tr("Line of G-code"), "mdi"):
            self._modes = faint().classes("num").mark("mdi-modes")
            with div("bench-row"):
                self._field = ui.input(tr("as G0 X10 Y5, or G91 G1 X0.1 F100")).mark("mdi-line")
                self._field.props("spellcheck=false autocomplete=off").style("flex: 1 1 220px")
                self._field.on("keydown.enter", self._send)
                self._run = button(tr("Run line"), self._send, "mdi-run", icon="play_arrow")
            place = div("bench-row").mark("mdi-history")
        self._history = Rebuilt(place, self._show_sent)

    def refresh(self, status: MachineStatus) -> None:
        """Show the modal words that hold for the next line."""
        self._modes.set_text(tr("holds: {modes}", modes=status.program.modes))
        offer(self._page, [self._run], status, "run_line")
        self._history.show(self._sent)

    async def _send(self) -> None:
        line = (self._field.value or "").strip()
        if not line:
            return
        answer = await self._page.ask("run_line", value=line)
        if answer is not None and answer.accepted:
            self._sent = (line, *(sent for sent in self._sent if sent != line))[:KEPT]
            self._field.set_value("")

    def _show_sent(self, lines: tuple[str, ...]) -> None:
        for number, line in enumerate(lines):
            again = button(line, partial(self._field.set_value, line), f"mdi-again-{number}", look="flat")
            again.classes("num").props("dense")
