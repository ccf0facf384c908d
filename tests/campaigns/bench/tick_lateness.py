"""Lateness of the daemon's 1 kHz tick, and ticks missed, against `cyclictest` in the same minute.

Lateness is the moment a tick is served less the instant the absolute timer was set to. The daemon runs a
circle against `hil-sim --pacing realtime` on localcan and records it, as it does for a user; only the
daemon gets SCHED_FIFO. Each round runs the four, so that a busy minute hits all of them.
"""

from __future__ import annotations

import asyncio
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.cycle.realtime import RealtimeError
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import SimulatorError, simulated_machine
from tests.campaigns.bench import cyclictest
from tests.campaigns.bench.outcome import Ratio, Section, Skip

HERE = Path(__file__).parent
MACHINE = HERE.parents[2] / "machines" / "xy_table"
PROGRAM = HERE / "circle.toml"
ROUNDS = 2
"""Of 6,000 ticks each: 12,000 and more of either kind. With `main --rounds 100` it is ten minutes of each."""
TICKS = 5000
ATTEMPTS = 3
"""A run stops when inputs stay away or an axis falls behind, as happens on a computer that is too busy."""
MISSED_AIM, LATE_AIM = 10.0, 0.1
"""Of 10,000 ticks, and per cent of the cycles."""
SHARES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}
POLICIES = {"SCHED_OTHER": False, "SCHED_FIFO": True}


class Ticks(NamedTuple):
    """Lateness in whole microseconds -> ticks, pooled over the rounds; `missed` never got their turn."""

    lateness: Counter[int]
    missed: int
    served: int
    late_cycles: int
    """Cycles in which inputs of any node came after the next SYNC."""
    stopped_runs: int

    @classmethod
    def of(cls, report: RunReport) -> Ticks:
        assert report.lateness is not None  # of a run in real time
        counts = Counter({us: ticks for us, ticks in enumerate(report.lateness._counts) if ticks})
        stopped = int(not report.completed)
        served, late_cycles = report.lateness.count, report.cycles_with_missing_inputs
        return cls(counts, report.missed_ticks, served, late_cycles, stopped)

    def __add__(self, other: Ticks) -> Ticks:  # type: ignore[override]  # not the sum of tuples
        return Ticks(*(mine + theirs for mine, theirs in zip(self, other, strict=True)))

    @property
    def missed_of_10000(self) -> float:
        return 1e4 * self.missed / (self.missed + self.served)

    @property
    def late_percent(self) -> float:
        return 100.0 * self.late_cycles / self.served

    def as_json(self) -> dict[str, Any]:
        percentiles = {name: cyclictest.percentile_us(self.lateness, share) for name, share in SHARES.items()}
        return {
            "lateness_us": percentiles,
            "ticks": self.served,
            "missed": self.missed,
            "missed_of_10000": self.missed_of_10000,
            "late_cycles": self.late_cycles,
            "late_percent": self.late_percent,
            "stopped_runs": self.stopped_runs,
        }


def measure(progress: Callable[[str], None], rounds: int = ROUNDS) -> Section:
    """Ours and cyclictest under both policies, in turn."""
    return asyncio.run(_measure(progress, rounds))


async def _measure(progress: Callable[[str], None], rounds: int) -> Section:
    ours: dict[str, Ticks] = {}
    yardstick: dict[str, Counter[int]] = {}
    skips: dict[str, Skip] = {}
    if not cyclictest.available():
        skips["cyclictest"] = Skip("cyclictest", "not installed (package rt-tests)")
    machine = load_machine(MACHINE)
    for repeat in range(rounds):
        for policy, fifo in POLICIES.items():
            progress(f"tick lateness: {policy}, round {repeat + 1} of {rounds}")
            if policy in skips:
                continue
            try:
                async with simulated_machine(MACHINE, "realtime", fifo=fifo) as bus:
                    ticks = await _run_ours(bus, fifo=fifo)
            except (RealtimeError, SimulatorError) as error:
                skips[policy] = Skip(policy, str(error))
                continue
            ours[policy] = ours[policy] + ticks if policy in ours else ticks
            if "cyclictest" not in skips:
                try:
                    counts = await asyncio.to_thread(
                        cyclictest.run, ticks.served, machine.bus.sync_period_us, fifo=fifo
                    )
                except subprocess.SubprocessError as error:
                    answer = str(getattr(error, "stderr", "") or error).strip().splitlines()
                    skips["cyclictest"] = Skip("cyclictest", f"failed: {answer[-1]}")
                    continue
                yardstick[policy] = yardstick.get(policy, Counter()) + counts
    return _section(ours, yardstick, list(skips.values()))


async def _run_ours(bus: str, *, fifo: bool) -> Ticks:
    """The circle, run again where it was stopped early; all ticks count."""
    machine = load_machine(MACHINE)
    program = load_program(PROGRAM, machine)
    pooled: Ticks | None = None
    for _ in range(ATTEMPTS):
        with tempfile.TemporaryDirectory(prefix="bench-") as folder:
            recording = Path(folder) / "recording"
            report = await run_machine(machine, program, bus, "realtime", recording, fifo=fifo)
        pooled = Ticks.of(report) if pooled is None else pooled + Ticks.of(report)
        if pooled.served >= TICKS:
            break
    assert pooled is not None
    return pooled


def _section(ours: dict[str, Ticks], yardstick: dict[str, Counter[int]], skips: list[Skip]) -> Section:
    facts: dict[str, Any] = {"ours": {policy: ticks.as_json() for policy, ticks in ours.items()}}
    facts["cyclictest"] = {
        policy: {
            "lateness_us": {name: cyclictest.percentile_us(counts, share) for name, share in SHARES.items()},
            "ticks": counts.total(),
        }
        for policy, counts in yardstick.items()
    }
    ratios = [
        Ratio(
            f"tick lateness {name}, {policy}, ours / cyclictest",
            cyclictest.percentile_us(ours[policy].lateness, share),
            max(cyclictest.percentile_us(counts, share), 1.0),
            "us",
            2.0 if name == "p99" else None,
            at_most=True,
        )
        for policy, counts in yardstick.items()
        for name, share in SHARES.items()
    ]
    for policy, ticks in ours.items():
        missed, late = ticks.missed_of_10000, ticks.late_percent
        ratios += [
            Ratio(f"missed of 10,000, {policy}, of its aim", missed, MISSED_AIM, "ticks", 1.0, at_most=True),
            Ratio(f"cycles with late inputs, {policy}, of its aim", late, LATE_AIM, "%", 1.0, at_most=True),
            Ratio(f"runs stopped by policy, {policy}", ticks.stopped_runs, 1.0, "runs", 0.0, at_most=True),
        ]
    return Section("tick lateness", facts, ratios, skips)
