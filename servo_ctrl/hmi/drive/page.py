"""The Drive page: state of each axis, switching on and off, homing, jogging, faults with advice."""

from collections.abc import Callable, Sequence

from nicegui import ui

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.drive.axis_card import SPEEDS_M_S, AxisMotionCard
from servo_ctrl.hmi.drive.events_card import EventsCard
from servo_ctrl.hmi.drive.faults import Fault, faults_in
from servo_ctrl.hmi.drive.offsets_card import OffsetsCard
from servo_ctrl.hmi.drive.step_jog import STEPS_M, ValueChoice
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.event_texts import reason_text
from servo_ctrl.hmi.shell.live_content import Rebuilt, TextTable, command_buttons, when_connected
from servo_ctrl.hmi.shell.machine_stage import shown_stage
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.overload import RecentShare, overload_text
from servo_ctrl.hmi.shell.parts import CROSS, card, div, faint

TITLE = word("Drive")
BUTTONS = {
    Command.ENABLE: (word("Enable"), "power_settings_new"),
    Command.DISABLE: (word("Disable"), "power_off"),
    Command.HOME: (word("Home"), "home"),
}
NODE_STATES = {
    "operational": word("in operation (operational)"),
    "pre_operational": word("waits (pre-operational)"),
    "stopped": word("stopped"),
    "booting": word("starts"),
    "unknown": word("no heartbeat yet"),
}
"""By the NMT state of CiA 301."""


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Sequence[Callable[[MachineStatus], None]]:
        faults = Rebuilt(div("bench-grid").props("role=alert").mark("faults"), show_faults)
        axis_cards = div("bench-grid")
        with div("bench-narrow-wide"):
            with div("bench-column"):
                power = PowerCard(page)
                jogging = JogCard(page)
                offsets = OffsetsCard(page, hello.axes)
            with axis_cards:
                axes = [
                    AxisMotionCard(page, axis, number, jogging.speed_m_s, jogging.step_m)
                    for number, axis in enumerate(hello.axes)
                ]
            with div("bench-column"):
                events = EventsCard(page)
                with card(tr("Nodes"), "nodes"):
                    nodes = TextTable("node-table", (tr("Node"), tr("No."), tr("State")))

        def refresh(status: MachineStatus) -> None:
            found = list(faults_in(status))
            faults.show(found)
            faults.element.set_visibility(bool(found))
            nodes.show(node_rows(status))

        parts = [axis.refresh for axis in axes]
        return [*parts, power.refresh, jogging.refresh, offsets.refresh, events.refresh, refresh]

    when_connected(page, make)


class PowerCard:
    """The card for switching on and off, and for homing."""

    def __init__(self, page: OpenPage) -> None:
        self._page, self._ticks, self._overload = page, RecentShare(), ""
        with card(tr("Power"), "power"):
            with div("bench-row"):
                self._buttons = command_buttons(page, BUTTONS, "flex: 1 1 0", doubt=self._doubt)
            self._reason = faint().mark("stage-reason")

    def refresh(self, status: MachineStatus) -> None:
        """Enable what is possible now, and show why the machine stands still."""
        self._overload = overload_text(self._ticks.take(status))
        for command, element in self._buttons.items():
            offer(self._page, [element], status, command)
        stage, reason = tr(shown_stage(status).word), reason_text(status)
        self._reason.set_text(f"{stage}: {reason}" if reason else stage)

    def _doubt(self, command: Command) -> str:
        """Return an objection to a command: a computer that is late must not control drives."""
        return self._overload if command is Command.ENABLE else ""


class JogCard:
    """The card for choosing the speed and the step of a jog, one for all axes of the page."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        with card(tr("Jog"), "jog-settings"):
            speed_text = word("Speed in {unit}, at most what the axis allows")
            self.speed_m_s = ValueChoice(SPEEDS_M_S, SPEEDS_M_S[1], speed_text, "jog-speed", tr("Jog speed"))
            faint(
                tr(
                    "Hold a button or an arrow key; the axis brakes when it is let go, when the page loses "
                    "the focus or its connection, and before the end of the travel."
                )
            )
            step_text = word("Step in {unit}: one press, one step; keys with Shift")
            self.step_m = ValueChoice(STEPS_M, STEPS_M[2], step_text, "jog-step", tr("Step of a jog"))

    def refresh(self, _status: MachineStatus) -> None:
        """Show speeds and steps in the visitor's units."""
        self.speed_m_s.refresh(self._page.units.velocity)
        self.step_m.refresh(self._page.units.length)


def show_faults(faults: Sequence[Fault]) -> None:
    """Show each fault with its advice."""
    for fault in faults:
        with div("bench-note bad").mark("fault"):
            with ui.element("b"):
                ui.label(f"{CROSS} {fault.where}: {tr(fault.advice.problem)}")
            ui.label(tr(fault.advice.remedy))
            faint(controller_text(fault.detail)).style("overflow-wrap: anywhere")


def node_rows(status: MachineStatus) -> list[tuple[str, str, str]]:
    """Return name, node id and NMT state of each node."""
    signs = {"operational": "\N{BLACK CIRCLE}"}
    return [
        (
            node.name,
            str(node.node_id),
            f"{signs.get(node.nmt_state, CROSS)} {tr(NODE_STATES.get(node.nmt_state, node.nmt_state))}",
        )
        for node in status.nodes
    ]
