"""Runs the cycle from the first SYNC to the last, with the tasks beside it, and reports on it."""

import asyncio
import time
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from can_frames.awake_loop import AwakeLoop
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.cycle import Cycle
from servo_ctrl.daemon.run.report import Progress, RunReport
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
        on_progress: Callable[[Progress], None],
        *,
        lockstep: bool,
    ) -> None:
        self.lateness: Lateness | None = None
        self.background: list[Callable[[], Coroutine[None, None, None]]] = []
        """Further coroutine functions to run beside the cycle until cancelled."""
        self.wall_s = 0.0
        self.first_sync = ""
        """Clock time of the first SYNC, ISO 8601; "" in lockstep, which no clock paces."""
        self.ended = asyncio.Event()
        """Set when the cycle has stopped."""
        self._config, self._motion, self._services, self._lockstep = config, motion, services, lockstep
        self._machine, self._on_progress = services.machine, on_progress
        self._failure: BaseException | None = None

    async def run(self, cycle: Cycle, recording: RunRecording, port: CanPort) -> None:
        """Cycle until the machine is off. An exception in a callback stops the cycle and is raised here."""
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(partial(self._on_exception, cycle))
        clock = None if self._lockstep else TimerfdClock(self._config.bus.sync_period_us * 1000, cycle.begin)
        start_s = time.monotonic()
        try:
            if clock is not None:
                await port.caught_up()
            async with asyncio.TaskGroup() as group:
                background = [self._watch_progress(cycle, recording), *self._services.tasks()]
                background += [begin() for begin in self.background]
                if clock is None:
                    background.append(self._watch_inputs(cycle))
                tasks = [group.create_task(self._guarded(cycle, coroutine)) for coroutine in background]
                try:
                    if clock is None:
                        port.on_burst = AwakeLoop(loop, port.read_arrived, port.peers).on_burst
                        cycle.begin()
                    else:
                        self.lateness = clock.lateness
                        self.first_sync = datetime.now(UTC).isoformat(timespec="milliseconds")
                        clock.start(loop)
                    await self.ended.wait()
                finally:
                    cycle.stop()  # also when the run is cancelled, before waiting for the tasks beside it
                self.wall_s = time.monotonic() - start_s
                if self._failure is None:
                    await self._services.finish()
                for task in tasks:
                    task.cancel()
        finally:
            if clock is not None:
                clock.close()
            loop.set_exception_handler(None)
        self._report_progress(cycle)
        if self._failure is not None:
            raise self._failure

    def report(self, cycle: Cycle, signal: str, recording: Path | None) -> RunReport:
        """Return the report of the run; `signal`: the signal that stopped it, "" without one."""
        machine, services = self._machine, self._services
        return RunReport(
            machine=self._config.machine.name,
            completed=services.completed,
            failed=machine.failed or bool(services.problem),
            signal=signal,
            reason="; ".join(text for text in (machine.reason, services.problem) if text),
            events=tuple(machine.events.kept),
            cycles=cycle.number + 1,
            missed_ticks=machine.missed_ticks,
            missing_inputs=machine.missing_inputs,
            cycles_with_missing_inputs=machine.cycles_with_missing_inputs,
            wall_s=self.wall_s,
            spans=tuple(self._motion.spans),
            lateness=self.lateness,
            recording=recording,
            learning=services.learning.job.status(),
            outcomes=tuple(services.learning.job.outcomes),
            event_cycles=tuple(machine.events.kept_cycles),
            first_sync=self.first_sync,
        )

    async def _guarded(self, cycle: Cycle, background: Coroutine[None, None, None]) -> None:
        """Run a coroutine beside the cycle; if it fails, stop the cycle in order."""
        try:
            await background
        except Exception as error:  # noqa: BLE001  # raised again once the cycle has stopped
            self._fail(cycle, error)

    def _on_exception(self, cycle: Cycle, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Stop the cycle in order after a callback failed: even then the drives need a controlled stop."""
        if (exception := context.get("exception")) is None:
            loop.default_exception_handler(context)
        else:
            self._fail(cycle, exception)

    def _fail(self, cycle: Cycle, error: BaseException) -> None:
        self._failure = self._failure or error
        cycle.stop()

    async def _watch_inputs(self, cycle: Cycle) -> None:
        """Bound the time that lockstep waits for inputs."""
        while cycle.running:
            number = cycle.number
            await asyncio.sleep(self._config.bus.input_timeout_ms * 1e-3)
            if cycle.running and cycle.number == number and cycle.open:
                cycle.complete_without_missing()

    async def _watch_progress(self, cycle: Cycle, recording: RunRecording) -> None:
        """Report progress; publish the recording's header at each step, and recording faults as events."""
        published, noted = -1, ""
        while True:
            await asyncio.sleep(PROGRESS_S)
            if (text := recording.problem) and text != noted:
                noted = text
                self._machine.note(text)
            spans = self._motion.spans
            if spans and spans[-1].step != published:
                published = spans[-1].step
                recording.publish(spans)
            self._report_progress(cycle)

    def _report_progress(self, cycle: Cycle) -> None:
        machine, learning = self._machine, self._services.learning.job.status()
        done = self._motion.progress
        if learning.planned:
            done = learning.strokes_done / max(learning.strokes_total, 1)
        step, label = -1, ""
        if machine.stage is Stage.RUNNING and machine.program is not None and machine.program.spans:
            span = machine.program.spans[-1]
            step, label = span.step, span.label
        number = max(cycle.number, 0)
        self._on_progress(
            Progress(
                stage=machine.stage,
                cycle=number,
                time_s=number * self._config.period_s,
                step=step,
                label=label,
                done=done,
                learning=learning,
                events=tuple(machine.events.kept),
                events_count=machine.events.count,
            )
        )
