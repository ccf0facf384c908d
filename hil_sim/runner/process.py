"""The simulator process: bench, pacing and bus in one asyncio loop, until a signal ends it."""

import asyncio
import contextlib
import gc
import signal
from collections.abc import Callable, Sequence
from pathlib import Path

from can_frames.awake_loop import AwakeLoop
from hil_sim.config import PlantConfig
from hil_sim.faults.schedule import Fault
from hil_sim.runner.bench import SimulatedMachine
from hil_sim.runner.can_port import CanPort
from hil_sim.runner.pacing import Lockstep, RealTime
from hil_sim.runner.realtime import take_priority
from kernels.batch_scheduling import batch_scheduling
from kernels.compiler_memory import release_compiler
from kernels.short_slice import short_slice


async def serve(
    config: PlantConfig,
    open_port: Callable[[], CanPort],
    *,
    realtime: bool,
    fifo: bool = False,
    state_directory: Path | None,
    on_ready: Callable[[SimulatedMachine], None],
    faults: Sequence[Fault] = (),
) -> None:
    """Simulate until SIGTERM or SIGINT; calls `on_ready` when the nodes are on the bus.

    It opens the bus after compiling the plant: a process that serves the bus must not make its clients wait.
    Until the end of the simulation the process has the policy SCHED_BATCH in lockstep, in real time the
    shortest time slice, or with `fifo` a priority.

    Raises:
        ConfigError, FaultError: see `SimulatedMachine`.
        BusError: the bus is lost, or cannot be waited on.
        RealtimeError: `fifo` is not permitted.
    """

    def send(can_id: int, data: bytes) -> None:
        port.send(can_id, data)

    bench = SimulatedMachine(config, send, state_directory, faults)
    release_compiler()  # all kernels are loaded
    with _scheduling(realtime=realtime, fifo=fifo), contextlib.closing(open_port()) as port:
        port.on_overrun = bench.on_overrun
        port.on_remote = bench.frames.handle_remote
        bench.send_burst = port.send_burst
        port.on_restart = bench.on_restart
        pacing = RealTime(bench) if realtime else Lockstep(bench)
        if fifo:
            take_priority()
        await _run(bench, port, pacing, on_ready)


def _scheduling(*, realtime: bool, fifo: bool) -> contextlib.AbstractContextManager[None]:
    if fifo:
        return contextlib.nullcontext()  # `take_priority` follows, once the bus is open
    return short_slice() if realtime else batch_scheduling()


async def _run(
    bench: SimulatedMachine,
    port: CanPort,
    pacing: Lockstep | RealTime,
    on_ready: Callable[[SimulatedMachine], None],
) -> None:
    descriptor = port.fileno()
    loop = asyncio.get_running_loop()
    ended: asyncio.Future[None] = loop.create_future()

    def end() -> None:
        if not ended.done():
            ended.set_result(None)

    def act(action: Callable[[], int | None]) -> int:
        """Run `action`, then send its frames; return its result. A failure ends the simulation."""
        if ended.done():
            return 0
        try:
            result = action() or 0
            port.flush()
        except Exception as failure:  # noqa: BLE001  # asyncio would log it and continue
            ended.set_exception(failure)
            return 0
        if port.more:
            loop.call_soon(receive)
        return result

    def receive() -> bool:
        """Serve the received frames; return whether there were any."""
        received = act(lambda: port.drain(bench.frames.handle, bench.serve_burst)) > 0
        if received:
            on_burst()
        return received

    on_burst = AwakeLoop(loop, receive, port.peers).on_burst if isinstance(pacing, Lockstep) else lambda: None

    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, end)
    loop.add_reader(descriptor, receive)
    timer = asyncio.create_task(_quiet(pacing, lambda: act(pacing.on_quiet)))
    try:
        act(bench.start)
        on_ready(bench)
        gc.collect(1)  # garbage of the start alone: a full collection takes half a second
        gc.freeze()  # the long-lived dictionaries would cost milliseconds in every full collection
        await ended
    finally:
        loop.remove_reader(descriptor)
        timer.cancel()
        await asyncio.gather(timer, return_exceptions=True)


async def _quiet(pacing: Lockstep | RealTime, action: Callable[[], object]) -> None:
    if pacing.quiet_period_s is None:
        return
    while True:
        await asyncio.sleep(pacing.quiet_period_s)
        action()
