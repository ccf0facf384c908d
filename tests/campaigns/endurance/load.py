"""One run of the table in real time under a load on the bus, the processors or the disk."""

import asyncio
import contextlib
import os
import re
import sys
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.load import load_program
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hil_rig.simulated_machine import ends_with_its_parent
from servo_ctrl.recording import recorder
from tests.campaigns.endurance.rig import Rig, Station, table_at
from tests.campaigns.endurance.run_counts import compare_counts
from tests.campaigns.endurance.soak import program_text

BIT_RATE = 1_000_000
TIME_TOLERANCE_S = 0.25
"""Tolerated difference between the duration by cycles and by the clock of the observer, seconds; chosen."""
PERCENTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}


class Scenario(NamedTuple):
    """The loads of one run."""

    name: str
    bus_share: float = 0.0
    """Bus load as a share of the bit rate, including the frames of the table; 0 = no foreign frames."""
    busy: bool = False
    """Whether a process computes on every processor."""
    stall_s: float = 0.0
    """Time for which the disk writes nothing, from the second part of the recording on; inf = for ever."""


SCENARIOS = (
    Scenario("alone"),
    Scenario("bus at 95 %", bus_share=0.95),
    Scenario("processors at 100 %", busy=True),
    Scenario("disk stalls for 8 s", stall_s=8.0),
    Scenario("disk stalls for 25 s", stall_s=25.0),
    Scenario("disk hangs for ever", stall_s=float("inf")),
    Scenario("all at once", bus_share=0.95, busy=True, stall_s=25.0),
)


@contextlib.asynccontextmanager
async def processors_busy() -> AsyncIterator[None]:
    """Run as many processes as there are processors, each at full load and with normal priority."""
    busy = [
        await asyncio.create_subprocess_exec(
            sys.executable, "-c", "while True: pass", preexec_fn=ends_with_its_parent()
        )
        for _ in range(os.cpu_count() or 1)
    ]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            await process.wait()


@contextlib.contextmanager
def disk_stalls(directory: Path, stall_s: float) -> Iterator[None]:
    """Delay the second part of the recording, and so all later ones, by this time.

    For a disk that hangs for ever, a pipe without a reader takes the place of the part: the thread of the
    writer hangs in the system call, as on a dead network drive.
    """
    if stall_s == float("inf"):
        directory.mkdir(parents=True)
        os.mkfifo(directory / "part-00001.parquet.tmp")
        yield
        return
    write_part = recorder.write_part

    def write_late(path: Path, *rest: Any) -> None:
        if path.name == "part-00001.parquet":
            time.sleep(stall_s)
        write_part(path, *rest)

    recorder.write_part = write_late
    try:
        yield
    finally:
        recorder.write_part = write_part


async def run_under(
    scenario: Scenario,
    table: Rig,
    observer: Station,
    foreign: Station,
    directory: Path,
    *,
    own_bits_per_s: float,
    seconds: float,
    period_us: int,
    fifo: bool,
) -> dict[str, Any]:
    """Make the run, and compare its counts with those of the stations; return the figures."""
    machine = table_at(period_us)
    file = directory.with_suffix(".toml")
    file.write_text(program_text(seconds), encoding="utf-8")
    program = load_program(file, machine)
    refusal, report = "", None
    async with contextlib.AsyncExitStack() as stack:
        if scenario.busy:
            await stack.enter_async_context(processors_busy())
        if scenario.stall_s:
            stack.enter_context(disk_stalls(directory, scenario.stall_s))
        rate = max(scenario.bus_share * BIT_RATE - own_bits_per_s, 0.0) if scenario.bus_share else 0.0
        await foreign.request(f"rate {rate:.0f}")
        await observer.request("begin")
        try:
            report = await run_machine(machine, program, table.bus, "realtime", directory, fifo=fifo)
        except ServoCtrlError as error:
            refusal = str(error)
        counted = await observer.request("count")
        await foreign.request("rate 0")
    return {"scenario": scenario.name, "fifo": fifo} | outcome_of(
        report, counted, directory, refusal, machine.period_s
    )


def outcome_of(
    report: RunReport | None, counted: dict[str, Any], directory: Path, refusal: str, period_s: float
) -> dict[str, Any]:
    """Return the figures of a run; `silent` lists losses without a report, and must be empty."""
    figures: dict[str, Any] = {
        "bus_load": counted["sync_bits"] / BIT_RATE / max(counted["sync_seconds"], 1e-3),
        "longest_sync_gap_ms": round(counted["longest_sync_gap_ms"], 2),
        "sync_gaps_above_ms": counted["sync_gaps_above_ms"],
    }
    if report is None:
        return {**figures, "ended": "did not begin", "reason": refusal, "silent": []}
    loss = re.search(r"(\d+) rows lost", report.reason)
    rows_lost = int(loss[1]) if loss else 0
    run_counts = compare_counts(report, counted, directory, rows_lost, tpdos_may_be_missing=True)
    silent = list(run_counts.faults)
    time_s = (report.cycles - 1) * period_s
    if abs(counted["sync_seconds"] - time_s) > TIME_TOLERANCE_S:
        silent.append(f"{report.cycles} cycles took {counted['sync_seconds']:.3f} s on the bus")
    if not report.completed and not report.reason:
        silent.append("the run ended before its program, without a reason")
    lateness = report.lateness
    return {
        **figures,
        "ended": "completed" if report.completed else "stopped",
        "failed": report.failed,
        "reason": report.reason,
        "events": list(report.events),
        "cycles": report.cycles,
        "missed_ticks": report.missed_ticks,
        "missed_of_1000": round(1e3 * report.missed_ticks / max(report.cycles, 1), 2),
        "missing_inputs": report.missing_inputs,
        "lateness_us": {name: lateness.percentile_us(share) for name, share in PERCENTILES.items()}
        if lateness is not None
        else None,
        "rows": run_counts.rows,
        "rows_lost": rows_lost,
        "silent": silent,
    }
