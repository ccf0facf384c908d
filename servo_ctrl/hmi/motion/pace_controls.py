"""How the program is run: overrides of feed and rapid moves, single block, optional stop."""

from functools import partial

from nicegui import ui

from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import Switch, div, faint, named

OVERRIDES = {"feed_override_percent": word("Feed"), "rapid_override_percent": word("Rapid")}
CHOICES = {
    "feed_override_percent": (10, 25, 50, 75, 100, 120, 150),
    "rapid_override_percent": (1, 10, 25, 50, 75, 100),
}
"""Per cent; what another client has set beside them is shown as it is."""
SWITCHES = {"single_block": word("Single block"), "optional_stop": word("Optional stop (M1)")}


class PaceControls:
    """A row that shows the settings of the machine and asks for others."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._shown: dict[str, float] = {}
        self._toggles: dict[str, ui.toggle] = {}
        with div("bench-row").mark("pace"):
            for name, title in OVERRIDES.items():
                with div("bench-row").style("flex-wrap: nowrap"):
                    faint(f"{tr(title)} %")
                    toggle = ui.toggle({}, on_change=partial(self._choose, name)).classes("num")
                    toggle.props('no-caps unelevated padding="8px 6px"')
                    named(toggle, tr("{pace} override in per cent", pace=tr(title)))
                    self._toggles[name] = toggle.mark(name.removesuffix("_percent").replace("_", "-"))
            self._switches = {
                name: Switch(tr(text), name.replace("_", "-"), partial(self._flip, name))
                for name, text in SWITCHES.items()
            }
        self._raised = faint(
            tr("Above 100 % from the next start: the program is planned to it, within the limits.")
        )
        self._raised.mark("feed-raised")

    def refresh(self, status: MachineStatus) -> None:
        """Show what holds."""
        for name, toggle in self._toggles.items():
            percent = getattr(status.settings, name)
            if percent != self._shown.get(name):
                self._shown[name] = percent
                options = sorted({*map(float, CHOICES[name]), percent})
                toggle.set_options({value: f"{value:g}" for value in options}, value=percent)
        self._raised.set_visibility(status.settings.feed_override_percent > 100.0)
        for name, switch in self._switches.items():
            switch.show(getattr(status.settings, name))

    async def _choose(self, name: str) -> None:
        percent = self._toggles[name].value
        if percent is None or percent == self._shown.get(name):
            return
        answer = await self._page.ask("setting", setting=name, value=float(percent))
        if answer is None or not answer.accepted:
            self._shown.pop(name, None)  # show what holds again

    async def _flip(self, name: str, on: bool) -> None:
        await self._page.ask("setting", setting=name, value=on)
