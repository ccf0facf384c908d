"""The simulator process: bench, pacing and bus in one asyncio loop, until a signal ends it."""

import asyncio
import contextlib
import gc
import os
import signal
from collections.abc import Callable, Sequence
from pathlib import Path

from hil_sim.config import PlantConfig
from hil_sim.faults.schedule import Fault
from hil_sim.runner.bench import Bench
from hil_sim.runner.can_port import CanPort
from hil_sim.runner.pacing import Lockstep, RealTime


async def serve(
    config: PlantConfig,
    port: CanPort,
    *,
    realtime: bool,
    state_directory: Path | None,
    on_ready: Callable[[Bench], None],
    faults: Sequence[Fault] = (),
) -> None:
    """Simulate until SIGTERM or SIGINT; calls `on_ready` when the nodes are on the bus.

    Raises:
        ConfigError, FaultError: see `Bench`.
        BusError: the bus is lost, or cannot be waited on.
    """
    descriptor = port.fileno()
    bench = Bench(config, port.send, state_directory, faults)
    port.on_overrun = bench.on_overrun
    pacing = RealTime(bench) if realtime else Lockstep(bench)
    if not realtime:
        _schedule_as_batch()
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[None] = loop.create_future()

    def end(failure: Exception | None = None) -> None:
        if ended.done():
            return
        if failure is None:
            ended.set_result(None)
        else:
            ended.set_exception(failure)

    def guarded(action: Callable[[], None]) -> Callable[[], None]:
        def run() -> None:
            try:
                action()
                port.flush()
            except Exception as failure:  # noqa: BLE001  # asyncio would log it and go on
                end(failure)

        return run

    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, end)
    loop.add_reader(descriptor, guarded(lambda: port.drain(bench.handle)))
    timer = asyncio.create_task(_quiet(pacing, guarded(pacing.on_quiet)))
    try:
        bench.start()
        port.flush()
        on_ready(bench)
        gc.collect()
        gc.freeze()  # the long-lived dictionaries would cost milliseconds in every full collection
        await ended
    finally:
        loop.remove_reader(descriptor)
        timer.cancel()
        await asyncio.gather(timer, return_exceptions=True)


def _schedule_as_batch() -> None:
    """Wake up after a burst of frames, not within it: in lockstep nothing is late, and wake-ups cost time."""
    if hasattr(os, "SCHED_BATCH") and os.sched_getscheduler(0) == os.SCHED_OTHER:
        with contextlib.suppress(OSError):  # a sandbox may forbid it
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


async def _quiet(pacing: Lockstep | RealTime, action: Callable[[], None]) -> None:
    if pacing.quiet_period_s is None:
        return
    while True:
        await asyncio.sleep(pacing.quiet_period_s)
        action()
