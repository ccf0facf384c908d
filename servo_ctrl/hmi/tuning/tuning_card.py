"""The card that tunes an axis: `servo-ctrl tune` on a simulator of its own, or by this controller."""

from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.files.tuning_files import LEAST_MS, MOST_MS, USUAL_MS
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.job_view import JobView
from servo_ctrl.hmi.shell.offered import offer, refusal_reason
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, choice, confirmed, div, errors_notified, faint, notify
from servo_ctrl.hmi.shell.program_jobs import ENDED, Job
from servo_ctrl.hmi.tuning.page_tunings import page_tunings_of


class TuningCard:
    """Starts a tuning, and shows the newest one; `on_end` is called with its directory once it has ended."""

    def __init__(self, page: OpenPage, hello: Hello, on_end: Callable[[Path], Awaitable[None]]) -> None:
        self._page, self._on_end = page, on_end
        self._machine_file = Path(hello.machine_file)
        self._tunings = page_tunings_of(page.services.recordings)
        self._running: Job | None = None
        names = [axis.name for axis in hello.axes]
        with card(tr("Tune an axis"), "simulator") as self._card:
            faint(
                tr(
                    "On a simulator of its own, made of the plant.toml beside the machine file, so that this "
                    "machine is not moved; or on this machine, from ready. It takes minutes, and the machine "
                    "file is not changed."
                )
            )
            with div("bench-row"):
                self._axis = choice(names, tr("Axis"), "tune-axis", "flex: 1 1 100px", value=names[0])
                self._ms = (
                    ui.number(tr("largest Ms"), value=USUAL_MS, min=LEAST_MS, max=MOST_MS, step=0.1)
                    .style("min-width: 110px")
                    .mark("tune-ms")
                )
                button(
                    tr("Tune on the simulator"),
                    self._start,
                    "run-tuning",
                    icon="play_arrow",
                    look="unelevated",
                )
                self._by_controller = button(
                    tr("Tune the machine"), self._start_on_machine, "tune-machine", icon="warning"
                )
            self._view = JobView(tr("Progress of the tuning"), controller_text, self._cancel)
        self.refresh()

    def refresh(self, status: MachineStatus | None = None) -> None:
        """Show the progress of the newest tuning, and look for its result once it has ended."""
        if status is not None:
            offer(self._page, [self._by_controller], status, "tuning_run")
        jobs, running = self._tunings.jobs, self._tunings.running
        self._view.show(jobs[-1] if jobs else None, running=running is not None)
        ended, self._running = self._running, running
        if ended is not None and ended.state in ENDED:
            with self._card:
                ui.timer(0.0, partial(self._on_end, ended.directory), once=True)

    async def _start(self) -> None:
        if self._page.permits(Role.OPERATE):
            with errors_notified("warning"):
                ms = float(self._ms.value or 0.0)
                await self._tunings.start(self._machine_file, str(self._axis.value), ms, self._page.who)
            self.refresh()

    async def _start_on_machine(self) -> None:
        """Tune by the controller of this page, once the visitor has confirmed that the axis may move."""
        axis = str(self._axis.value)
        details = tr(
            "The axis travels slowly through up to 80 % of its limits with a small force added, then makes a "
            "step of force, a short move and a circle, also with the proposed gains. Keep the way clear, and "
            "STOP within reach."
        )
        if not await confirmed(tr("Move axis {axis} of the machine?", axis=axis), details, tr("Tune")):
            return
        # the question is there since a status was; it may have changed meanwhile
        status = self._page.link.status
        if status is not None and (reason := refusal_reason(self._page, status, "tuning_run")):
            notify(reason)
            return
        with errors_notified("warning"):
            ms, who, controller = float(self._ms.value or 0.0), self._page.who, self._page.link.path
            await self._tunings.start(self._machine_file, axis, ms, who, controller)
            self._tunings.end_unless(lambda: not self._page.refusal("tuning_run"))
        self.refresh()

    async def _cancel(self) -> None:
        if self._page.permits(Role.OPERATE):
            await self._tunings.cancel(self._page.who)
