"""Faults of the computer and of its users: late ticks, a killed controller, disks, clocks, commands."""

from __future__ import annotations

import asyncio
import errno
import os
import shutil
import threading
import time
from typing import TYPE_CHECKING, Any

from servo_ctrl.commands.command import Command, CommandRequest
from tests.campaigns.campaign.fault_context import (
    MOVING,
    POWERED,
    REALTIME,
    STATES,
    WIRED,
    Fault,
    FaultContext,
)
from tests.campaigns.campaign.stand import ROWS_PER_PART

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.campaigns.campaign.stand import Stand

SHORT_GAP, LONG_GAP = (1, 15), (30, 80)
JOG_SPEED_MAX_M_S = 0.05
COMMANDS = tuple(Command)
LEARNING_STATES = ("learning",) * 6
"""Repeated so that `draw` takes these faults often: there are many writes to interrupt."""
DISK_WAIT_MAX_S = 10.0


def _late(context: FaultContext, periods: int) -> None:
    context.stand.late.append(periods)


def ticks_missed(context: FaultContext) -> None:
    """The next tick is late by a few periods."""
    _late(context, context.rng.randint(*SHORT_GAP))


def ticks_missed_long(context: FaultContext) -> None:
    """The next tick is late by more periods than tolerated."""
    _late(context, context.rng.randint(*LONG_GAP))


def controller_killed(context: FaultContext) -> None:
    """SIGKILL: the files stay as they are, and the controller sends nothing more."""
    _stop_controller(context.stand)
    context.stand.kill()


def _stop_controller(stand: Stand) -> None:
    """Stop all sending, and keep a copy of the present files."""
    stand.wire.controller_dead = True
    stand.killed_ticks, stand.killed_cycle = stand.ticks, stand.wire.cycle
    _wait_for_disk(stand)
    for name in ("recording", "learned"):
        if (stand.folder / name).exists():
            shutil.copytree(stand.folder / name, stand.folder / f"killed-{name}")


def _wait_for_disk(stand: Stand) -> None:
    """Wait for the disk, because simulated time runs faster than real time."""
    due_parts, deadline_s = stand.ticks // ROWS_PER_PART, time.monotonic() + DISK_WAIT_MAX_S
    while len(list((stand.folder / "recording").glob("part-*.parquet"))) < due_parts:
        if time.monotonic() > deadline_s:
            return
        time.sleep(0.002)


def task_cancelled(context: FaultContext) -> None:
    """The task of the run is cancelled, as by a program that embeds the daemon."""
    context.stand.kill()


def _act_at_write(
    context: FaultContext, number: int, act: Callable[[], None], *, without_recorder: bool
) -> None:
    """Call `act` at this write and all later ones; `without_recorder`: not at those of the recorder."""
    fsync, remaining = os.fsync, [number]

    def counted(descriptor: int) -> None:
        if not (without_recorder and threading.current_thread().name == "recorder"):
            remaining[0] -= 1
            if remaining[0] < 0:
                act()
        fsync(descriptor)

    os.fsync = counted
    context.undo.append(lambda: setattr(os, "fsync", fsync))


def _raise_disk_full() -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def disk_full(context: FaultContext) -> None:
    """The disk is full from now on; all data due before are written."""
    _wait_for_disk(context.stand)
    context.notes["full_ticks"] = context.stand.ticks
    _act_at_write(context, 0, _raise_disk_full, without_recorder=False)


def disk_full_while_learning(context: FaultContext) -> None:
    """The disk becomes full between two writes of a learning run."""
    _act_at_write(context, context.rng.randint(0, 11), _raise_disk_full, without_recorder=True)


def killed_while_writing(context: FaultContext) -> None:
    """SIGKILL at a write of a learning run, which may leave half of a file."""

    def kill() -> None:
        if not context.wire.controller_dead:
            context.stand.loop.call_soon_threadsafe(context.stand.kill)
            _stop_controller(context.stand)

    _act_at_write(context, context.rng.randint(0, 11), kill, without_recorder=True)


def clock_step(context: FaultContext) -> None:
    """The wall clock is set forward or back by up to a day."""
    step_s = context.rng.choice((-1.0, 1.0)) * context.rng.uniform(1.0, 1e5)
    now, now_ns = time.time, time.time_ns

    def restore() -> None:
        time.time, time.time_ns = now, now_ns

    time.time = lambda: now() + step_s
    time.time_ns = lambda: now_ns() + int(step_s * 1e9)
    context.undo.append(restore)


def broker_gone(context: FaultContext) -> None:
    """The MQTT broker closes, or stops responding."""
    context.notes["published"] = context.stand.broker.received
    context.rng.choice((context.stand.broker.close, context.stand.broker.stop_responding))()


def stop_signal(context: FaultContext) -> None:
    """SIGTERM."""
    context.stand.signal("SIGTERM")


def two_signals(context: FaultContext) -> None:
    """SIGTERM twice, the second of which stops faster."""
    context.stand.signal("SIGTERM")
    context.stand.loop.call_later(context.rng.uniform(0.001, 0.02), context.stand.signal, "SIGTERM")


def command(requested: Command) -> Callable[[FaultContext], None]:
    """Return a fault that gives an operator command for the whole machine."""

    def inject(context: FaultContext) -> None:
        context.notes["verdict"] = context.stand.handler.execute(CommandRequest(requested))

    return inject


def busy_operator(context: FaultContext) -> None:
    """The operator gives random commands and jogs for a while, accepted or refused."""
    stand, rng = context.stand, context.rng

    def act_and_repeat(remaining: int) -> None:
        if stand.signal is _no_signal or not remaining:
            return
        if rng.random() < 0.3:
            stand.handler.jog(rng.choice("xy"), rng.uniform(-JOG_SPEED_MAX_M_S, JOG_SPEED_MAX_M_S))
        else:
            stand.handler.execute(CommandRequest(rng.choice(COMMANDS), rng.choice(("", "x", "y"))))
        stand.loop.call_later(rng.uniform(0.0, 0.04), act_and_repeat, remaining - 1)

    act_and_repeat(rng.randint(3, 12))


def _no_signal(_name: str) -> None:
    """Placeholder for the signal handler of a run that has ended."""


def bug(context: FaultContext) -> None:
    """An exception in a callback of the cycle, as from a software error."""

    def raise_error(*_: Any) -> None:
        raise ZeroDivisionError("planted by the campaign")

    asyncio.get_running_loop().call_soon(raise_error)
    context.notes["bug"] = True


FAULTS = (
    Fault("ticks missed briefly", ticks_missed, pacings=(REALTIME,), states=WIRED),
    Fault(
        "tick too late",
        ticks_missed_long,
        "tick too late",
        ("ticks were missed",),
        pacings=(REALTIME,),
        states=WIRED,
        blind_s=0.085,
    ),
    Fault("controller killed", controller_killed, kills="controller", states=WIRED, blind_s=0.085),
    Fault("task cancelled", task_cancelled, kills="task", states=STATES),
    Fault("bug of ours", bug, kills="task", states=WIRED),
    Fault("disk full", disk_full, None, ("cannot be written", "No space left"), states=WIRED),
    Fault(
        "disk full while learning",
        disk_full_while_learning,
        states=LEARNING_STATES,
        ticks_after=800,
        may_stop=True,
    ),
    Fault(
        "killed while writing",
        killed_while_writing,
        kills="controller",
        states=LEARNING_STATES,
        ticks_after=800,
        blind_s=0.085,
    ),
    Fault("MQTT broker gone", broker_gone, states=WIRED, pacings=(REALTIME,), broker=True),
    Fault("clock step", clock_step),
    Fault("stop signal", stop_signal, "stop signal", ("stopped by SIGTERM",)),
    Fault("stop signal twice", two_signals, "stop signal", ("stopped by SIGTERM",), states=WIRED),
    Fault(
        "switched off",
        command(Command.DISABLE),
        "switched off",
        ("switched off",),
        states=("starting", "ready", *MOVING),
    ),
    Fault(
        "quick stop",
        command(Command.QUICK_STOP),
        "quick stop",
        ("quick stop",),
        states=(*POWERED, "starting"),
    ),
    Fault("operator at random", busy_operator, None, (), states=(*POWERED, "standby"), may_stop=True),
)
