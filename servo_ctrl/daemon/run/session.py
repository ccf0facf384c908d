"""From the first SYNC to the last: pacing, watching inputs and progress, what runs beside the cycle."""

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import Any

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.assembly import Assembly
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.run_recording import RunRecording
from servo_ctrl.daemon.run.services import Services
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.io.can_port import CanPort
from servo_ctrl.io.clock import Lateness, TimerfdClock

PROGRESS_S = 0.1


class Session:
    """One run of the cycle."""

    def __init__(
        self,
        config: MachineConfig,
        motion: MotionPlan,
        services: Services,
        *,
        lockstep: bool,
        on_progress: Callable[[Progress], None],
    ) -> None:
        self.lateness: Lateness | None = None
        self.wall_s = 0.0
        self._config, self._motion, self._services, self._lockstep = config, motion, services, lockstep
        self._on_progress = on_progress
        self._assembly: Assembly | None = None
        self._ended = asyncio.Event()
        self._crash: BaseException | None = None

    def on_end(self) -> None:
        """The cycle has stopped."""
        self._ended.set()

    def stop(self, signal_name: str) -> None:
        """A signal wants the machine to stop."""
        if self._assembly is not None:
            self._assembly.machine.event(Event.STOP_SIGNAL, f"stopped by {signal_name}")

    async def run(self, assembly: Assembly, recording: RunRecording, port: CanPort) -> None:
        """Cycle until the machine is off. An exception in a callback stops the cycle and comes out here."""
        self._assembly = assembly
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(self._on_exception)
        clock = None if self._lockstep else TimerfdClock(self._period_ns, assembly.cycle.begin)
        start_s = time.monotonic()
        try:
            if clock is not None:
                await port.caught_up()
            async with asyncio.TaskGroup() as group:
                beside = [self._watch_progress(assembly, recording), *self._services.tasks()]
                if clock is None:
                    beside.append(self._watch_inputs(assembly))
                tasks = [group.create_task(self._guarded(coroutine)) for coroutine in beside]
                try:
                    if clock is None:
                        assembly.cycle.begin()
                    else:
                        self.lateness = clock.lateness
                        clock.start(loop)
                    await self._ended.wait()
                finally:
                    assembly.cycle.stop()  # also of a run that is cancelled, whatever those beside wait for
                self.wall_s = time.monotonic() - start_s
                if self._crash is None:
                    await self._services.finish()
                for task in tasks:
                    task.cancel()
        finally:
            if clock is not None:
                clock.close()
            loop.set_exception_handler(None)
        self._report(assembly)
        if self._crash is not None:
            raise self._crash

    @property
    def _period_ns(self) -> int:
        return self._config.bus.sync_period_us * 1000

    async def _guarded(self, beside: Coroutine[None, None, None]) -> None:
        """Run what goes on beside the cycle; where it fails, the cycle stops in order."""
        try:
            await beside
        except Exception as error:  # noqa: BLE001  # raised again once the cycle has stopped
            self._crashed(error)

    async def _watch_inputs(self, assembly: Assembly) -> None:
        """Lockstep waits for inputs, but not for ever."""
        cycle, timeout_s = assembly.cycle, self._config.bus.input_timeout_ms * 1e-3
        while cycle.running:
            number = cycle.number
            await asyncio.sleep(timeout_s)
            if cycle.running and cycle.number == number and cycle.open:
                cycle.complete_without()

    async def _watch_progress(self, assembly: Assembly, recording: RunRecording) -> None:
        """Tell how far it is, the recording whenever a step begins, and the machine what is not recorded."""
        published, told = -1, ""
        while True:
            await asyncio.sleep(PROGRESS_S)
            if (text := recording.trouble) and text != told:
                told = text
                assembly.machine.note(text)
            spans = self._motion.spans
            if spans and spans[-1].step != published:
                published = spans[-1].step
                recording.publish(spans)
            self._report(assembly)

    def _report(self, assembly: Assembly) -> None:
        machine, cycle = assembly
        done, step, label = 0.0, -1, ""
        main, learning = self._motion.current, self._services.job.status()
        if learning.begun:
            done = learning.strokes_done / max(learning.strokes_total, 1)
        elif main is not None:
            done = self._motion.progress
        if machine.stage is Stage.RUNNING and machine.program is not None and machine.program.spans:
            span = machine.program.spans[-1]
            step, label = span.step, span.label
        number = max(cycle.number, 0)
        time_s = number * self._config.period_s
        events = tuple(machine.events.kept)
        count = machine.events.count
        self._on_progress(
            Progress(
                stage=machine.stage,
                cycle=number,
                time_s=time_s,
                step=step,
                label=label,
                done=done,
                learning=learning,
                events=events,
                events_count=count,
            )
        )

    def _on_exception(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """A callback failed: that is a bug of ours, and no reason to leave the drives alone with it."""
        exception = context.get("exception")
        if exception is None:
            loop.default_exception_handler(context)
            return
        self._crashed(exception)

    def _crashed(self, error: BaseException) -> None:
        self._crash = self._crash or error
        if self._assembly is not None:
            self._assembly.cycle.stop()
