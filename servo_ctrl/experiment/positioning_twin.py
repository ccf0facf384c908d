"""The positioning study in the batch twin, as a program of its own: it knows the plant, nothing here does."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.experiment.positioning_readings import load_readings

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from servo_ctrl.experiment.positioning_readings import Deviations

TWIN_LIMIT_S = 1200.0
"""All stages take two minutes on two idle cores."""
LINES_KEPT = 3


class PositioningError(ServoCtrlError):
    """The study in the twin did not come to its end."""


class TwinRun(NamedTuple):
    """What the twin has found. `out` is the folder of its readings and of what it learned."""

    out: Path
    found: dict[tuple[str, str], Deviations]
    machine_time_s: float
    wall_s: float


class Wanted(NamedTuple):
    """What the twin is to run; every series begins at power-up."""

    stages: Sequence[str]
    runs: int
    points: int
    series: Sequence[str]
    off_cycles: int = 0
    rest_cycles: int = 50


def run_in_twin(machine: Path, out: Path, wanted: Wanted, on_progress: Callable[[float], None]) -> TwinRun:
    """Run it; blocks for as long as it takes. `on_progress` is given the share that is done.

    Raises:
        ServoCtrlError: the twin failed, took too long, or left something else than readings.

    """
    command = [
        *(sys.executable, "-m", "reconcile.positioning", "--machine", str(machine), "--out", str(out)),
        *("--stages", ",".join(wanted.stages), "--series", ",".join(wanted.series)),
        *("--runs", str(wanted.runs), "--points", str(wanted.points)),
        *("--off-cycles", str(wanted.off_cycles), "--rest-cycles", str(wanted.rest_cycles)),
    ]
    told: dict[str, float] = {}
    last: list[str] = []
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as process:
        overdue = threading.Timer(TWIN_LIMIT_S, process.kill)
        overdue.start()
        try:
            for line in process.stdout or ():
                _take(line.split(), told, on_progress)
                last = [*last, line.strip()][-LINES_KEPT:]
            process.wait()
        finally:
            overdue.cancel()
            if process.poll() is None:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
    if process.returncode == -signal.SIGKILL:
        raise PositioningError(f"the batch twin was killed, or did not end within {TWIN_LIMIT_S:g} s")
    if process.returncode:
        raise PositioningError(f"the batch twin ended with {process.returncode}: {' | '.join(last)}")
    if not {"machine_time", "wall"} <= set(told):
        raise PositioningError(f"the batch twin did not say how long it took: {' | '.join(last)}")
    return TwinRun(out, load_readings(out / "readings.csv"), told["machine_time"], told["wall"])


def _take(words: list[str], told: dict[str, float], on_progress: Callable[[float], None]) -> None:
    """One line of the twin: "progress DONE TOTAL" or "NAME NUMBER"; another one is for people."""
    try:
        match words:
            case ["progress", done, total]:
                on_progress(float(done) / float(total))
            case [name, value]:
                told[name] = float(value)
    except (ValueError, ZeroDivisionError):
        return
