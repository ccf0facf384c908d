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
FASTEST_JOG_M_S = 0.05
COMMANDS = tuple(Command)
OFTEN = ("learning",) * 6
"""There are many writes to choose from."""
DISK_PATIENCE_S = 10.0


def _late(context: FaultContext, periods: int) -> None:
    context.stand.late.append(periods)


def ticks_missed(context: FaultContext) -> None:
    """The computer is late by a few periods."""
    _late(context, context.rng.randint(*SHORT_GAP))


def ticks_missed_long(context: FaultContext) -> None:
    """The computer is late by more than the axes sail through."""
    _late(context, context.rng.randint(*LONG_GAP))


def controller_killed(context: FaultContext) -> None:
    """SIGKILL: what is on the disk stays as it is, and nothing is sent any more."""
    _die(context.stand)
    context.stand.kill()


def _die(stand: Stand) -> None:
    """Nothing is sent any more, and a copy of the files stays behind as they are."""
    stand.wire.controller_dead = True
    stand.killed_ticks, stand.killed_cycle = stand.ticks, stand.wire.cycle
    _let_the_disk_keep_up(stand)
    for name in ("recording", "learned"):
        if (stand.folder / name).exists():
            shutil.copytree(stand.folder / name, stand.folder / f"killed-{name}")


def _let_the_disk_keep_up(stand: Stand) -> None:
    """Simulated time is faster than the disk, which would have had a thousand times as long."""
    due, deadline_s = stand.ticks // ROWS_PER_PART, time.monotonic() + DISK_PATIENCE_S
    while len(list((stand.folder / "recording").glob("part-*.parquet"))) < due:
        if time.monotonic() > deadline_s:
            return
        time.sleep(0.002)


def task_cancelled(context: FaultContext) -> None:
    """The run's task is cancelled, as by a program that embeds the daemon."""
    context.stand.kill()


def _at_write(context: FaultContext, number: int, act: Callable[[], None], *, ours: bool) -> None:
    """Act at this write from now on, and at all behind it; `ours`: without those of the recorder's thread."""
    fsync, left = os.fsync, [number]

    def counted(descriptor: int) -> None:
        if not (ours and threading.current_thread().name == "recorder"):
            left[0] -= 1
            if left[0] < 0:
                act()
        fsync(descriptor)

    os.fsync = counted
    context.undo.append(lambda: setattr(os, "fsync", fsync))


def _full() -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def disk_full(context: FaultContext) -> None:
    """Nothing can be written any more, but what was due until now is."""
    _let_the_disk_keep_up(context.stand)
    context.notes["full_ticks"] = context.stand.ticks
    _at_write(context, 0, _full, ours=False)


def disk_full_while_learning(context: FaultContext) -> None:
    """The disk is full in the midst of what is written while an axis learns."""
    _at_write(context, context.rng.randint(0, 11), _full, ours=True)


def killed_while_writing(context: FaultContext) -> None:
    """SIGKILL in the midst of what is written while an axis learns, half of a file perhaps on the disk."""

    def kill() -> None:
        if not context.wire.controller_dead:
            context.stand.loop.call_soon_threadsafe(context.stand.kill)
            _die(context.stand)

    _at_write(context, context.rng.randint(0, 11), kill, ours=True)


def clock_step(context: FaultContext) -> None:
    """The wall clock is set, by hours, forth or back."""
    step_s = context.rng.choice((-1.0, 1.0)) * context.rng.uniform(1.0, 1e5)
    now, now_ns = time.time, time.time_ns

    def restore() -> None:
        time.time, time.time_ns = now, now_ns

    time.time = lambda: now() + step_s
    time.time_ns = lambda: now_ns() + int(step_s * 1e9)
    context.undo.append(restore)


def broker_gone(context: FaultContext) -> None:
    """The MQTT broker dies, or answers no more."""
    context.notes["published"] = context.stand.broker.received
    context.rng.choice((context.stand.broker.die, context.stand.broker.fall_silent))()


def stop_signal(context: FaultContext) -> None:
    """SIGTERM."""
    context.stand.signal("SIGTERM")


def two_signals(context: FaultContext) -> None:
    """SIGTERM, and again: faster."""
    context.stand.signal("SIGTERM")
    context.stand.loop.call_later(context.rng.uniform(0.001, 0.02), context.stand.signal, "SIGTERM")


def command(which: Command) -> Callable[[FaultContext], None]:
    """An operator's command for the whole machine."""

    def inject(context: FaultContext) -> None:
        context.notes["verdict"] = context.stand.handler.execute(CommandRequest(which))

    return inject


def busy_operator(context: FaultContext) -> None:
    """Commands and jogging at random, accepted or refused, for a while."""
    stand, rng = context.stand, context.rng

    def again(left: int) -> None:
        if stand.signal is _gone or not left:
            return
        if rng.random() < 0.3:
            stand.handler.jog(rng.choice("xy"), rng.uniform(-FASTEST_JOG_M_S, FASTEST_JOG_M_S))
        else:
            stand.handler.execute(CommandRequest(rng.choice(COMMANDS), rng.choice(("", "x", "y"))))
        stand.loop.call_later(rng.uniform(0.0, 0.04), again, left - 1)

    again(rng.randint(3, 12))


def _gone(_name: str) -> None:
    """Nobody."""


def bug(context: FaultContext) -> None:
    """An exception in a callback of the cycle: a bug of ours."""

    def raises(*_: Any) -> None:
        raise ZeroDivisionError("planted by the campaign")

    asyncio.get_running_loop().call_soon(raises)
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
        states=OFTEN,
        watched=800,
        may_stop=True,
    ),
    Fault(
        "killed while writing",
        killed_while_writing,
        kills="controller",
        states=OFTEN,
        watched=800,
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
