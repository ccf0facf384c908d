"""The card that tunes an axis on the simulator: `servo-ctrl tune` beside the controller, on another bus."""

from collections.abc import Awaitable, Callable
from pathlib import Path

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.files.tuning_files import LEAST_MS, MOST_MS, USUAL_MS
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.job_view import JobView
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, choice, div, errors_notified, faint
from servo_ctrl.hmi.shell.program_jobs import ENDED, Job
from servo_ctrl.hmi.tuning.simulator_jobs import simulator_tunings_of


class SimulatorCard:
    """Starts a tuning, and shows the newest one; `on_end` is called once it has ended."""

    def __init__(self, page: OpenPage, hello: Hello, on_end: Callable[[], Awaitable[None]]) -> None:
        self._page, self._on_end = page, on_end
        self._machine_file = Path(hello.machine_file)
        self._tunings = simulator_tunings_of(page.services.recordings)
        self._running: Job | None = None
        names = [axis.name for axis in hello.axes]
        with card(tr("Tune on the simulator"), "simulator") as self._card:
            faint(
                tr(
                    "servo-ctrl tune on a simulator of its own, which is made of the plant.toml beside the "
                    "machine file. This machine is not moved, and its file is not changed. It takes minutes."
                )
            )
            with div("bench-row"):
                self._axis = choice(names, tr("Axis"), "tune-axis", "flex: 1 1 100px", value=names[0])
                self._ms = (
                    ui.number(tr("largest Ms"), value=USUAL_MS, min=LEAST_MS, max=MOST_MS, step=0.1)
                    .style("min-width: 110px")
                    .mark("tune-ms")
                )
                button(tr("Tune"), self._start, "run-tuning", icon="play_arrow", look="unelevated")
            self._view = JobView(tr("Progress of the tuning"), controller_text, self._cancel)
        self.refresh()

    def refresh(self, _status: MachineStatus | None = None) -> None:
        """Show the progress of the newest tuning, and look for its result once it has ended."""
        jobs = self._tunings.jobs
        newest = jobs.jobs[-1] if jobs.jobs else None
        self._view.show(newest, running=jobs.running is not None)
        ended, self._running = self._running, jobs.running
        if ended is not None and ended.state in ENDED:
            with self._card:
                ui.timer(0.0, self._on_end, once=True)

    async def _start(self) -> None:
        if self._page.permits(Role.OPERATE):
            with errors_notified("warning"):
                ms = float(self._ms.value or 0.0)
                await self._tunings.start(self._machine_file, str(self._axis.value), ms, self._page.who)
            self.refresh()

    async def _cancel(self) -> None:
        if self._page.permits(Role.OPERATE):
            await self._tunings.cancel(self._page.who)
