"""A soak: repeats the same production, and compares counts and resources after each run.

Hub and simulator run all the time; each run boots the nodes, homes, makes parts, stops and closes its
recording, as a shift does. What a run does not release shows in the next one.
"""

import asyncio
import shutil
from collections import deque
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.load import load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.run.report import Pacing, Progress, RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from tests.campaigns.endurance.process_resources import HeldResources, Sample, held_resources, sample
from tests.campaigns.endurance.rig import Rig, Station
from tests.campaigns.endurance.run_counts import RunCounts, compare_counts

SAMPLE_S = 2.0
"""Time between two samples of the resources, seconds; chosen."""
TURN_S = 4.712389
"""Duration of a turn with R = 25 mm at F = 2000 mm/min, seconds."""
PROGRAM = """
[[step]]
kind = "move"
label = "to the start"
to_mm = {{ x = 25.0, y = 0.0 }}
feed_mm_min = 2000.0

[[step]]
kind = "circle"
label = "parts"
radius_mm = 25.0
feed_mm_min = 2000.0
turns = {turns}
ramp_s = 0.5

[[step]]
kind = "move"
label = "home"
to_mm = {{ x = 0.0, y = 0.0 }}
feed_mm_min = 2000.0
"""


def program_text(machine_s: float) -> str:
    """Return a program that lasts about this machine time."""
    return PROGRAM.format(turns=max(round(machine_s / TURN_S, 2), 0.25))


class RunOutcome(NamedTuple):
    """One run of a soak."""

    report: RunReport
    counts: RunCounts
    held: HeldResources
    samples: tuple[Sample, ...]
    period_s: float
    realtime: bool

    @property
    def machine_s(self) -> float:
        return self.report.cycles * self.period_s

    @property
    def stop_reason(self) -> str:
        """The reason for an end before that of the program; "" if it was completed."""
        complete = self.report.completed and not self.report.failed
        return "" if complete else self.report.reason or "it ended without a reason"

    @property
    def faults(self) -> list[str]:
        """Texts of the faults. In real time a stop is none: the computer may be too busy."""
        return [*([self.stop_reason] if self.stop_reason and not self.realtime else []), *self.counts.faults]

    def as_json(self) -> dict[str, Any]:
        return {
            "machine_s": round(self.machine_s, 6),
            "wall_s": round(self.report.wall_s, 3),
            "books": self.counts.as_json(),
            "stopped": self.stop_reason,
            "missing_inputs": self.report.missing_inputs,
            "events": list(self.report.events),
            "held": self.held._asdict(),
            "faults": self.faults,
        }


class Recordings:
    """The directories of the recordings; only the last ones stay, so that the disk does not fill."""

    def __init__(self, folder: Path, recordings_kept: int) -> None:
        self._folder, self._kept = folder, recordings_kept
        self._directories: deque[Path] = deque()
        self._count = 0
        self.bytes = 0
        """Bytes written so far, including deleted recordings."""

    def next(self) -> Path:
        """Return a new directory, and delete the oldest one beyond those kept."""
        while len(self._directories) >= max(self._kept, 1):
            shutil.rmtree(self._directories.popleft())
        self._count += 1
        directory = self._folder / f"run-{self._count:06d}"
        self._directories.append(directory)
        return directory

    def present(self) -> list[Path]:
        """Return the directories on the disk."""
        return sorted(self._folder.glob("run-*"))

    def measure(self, directory: Path) -> None:
        """Add the size of a finished recording."""
        self.bytes += sum(file.stat().st_size for file in directory.iterdir())


class Soak:
    """Makes runs on a rig, with a station that counts the frames."""

    def __init__(
        self,
        machine: MachineConfig,
        folder: Path,
        pacing: Pacing,
        *,
        fifo: bool = False,
        recordings_kept: int = 2,
    ) -> None:
        self.machine = machine
        self.pacing, self._fifo, self._folder = pacing, fifo, folder
        self.recordings = Recordings(folder, recordings_kept)
        self._cycle = 0

    def use_rig(self, rig: Rig, station: Station) -> None:
        """Set rig and counting station of the next runs."""
        self._rig, self._station = rig, station

    async def run(self, machine_s: float) -> RunOutcome:
        """Make one run of about this machine time. Raises ServoCtrlError if it does not begin."""
        file = self._folder / "production.toml"
        file.write_text(program_text(machine_s), encoding="utf-8")
        program = load_program(file, self.machine)
        directory = self.recordings.next()
        await self._station.request("begin")
        samples: list[Sample] = []
        sampling = asyncio.create_task(self._sample_resources(samples))
        try:
            report = await run_machine(
                self.machine,
                program,
                self._rig.bus,
                self.pacing,
                directory,
                self._on_progress,
                fifo=self._fifo,
            )
        finally:
            sampling.cancel()
            await asyncio.gather(sampling, return_exceptions=True)
        bus_counts = await self._final_counts()
        realtime = self.pacing == "realtime"
        outcome = RunOutcome(
            report=report,
            counts=compare_counts(report, bus_counts, directory, tpdos_may_be_missing=realtime),
            held=held_resources(),
            samples=tuple(samples),
            period_s=self.machine.period_s,
            realtime=realtime,
        )
        self.recordings.measure(directory)
        return outcome

    async def _final_counts(self) -> dict[str, Any]:
        """Return the counts of the station once no further SYNC arrives, including pending frames."""
        before: dict[str, Any] = {}
        for _ in range(20):
            bus_counts = await self._station.request("count")
            if bus_counts["frames"].get("080") == before.get("080"):
                return bus_counts
            before = bus_counts["frames"]
            await asyncio.sleep(0.1)
        return bus_counts

    async def _sample_resources(self, samples: list[Sample]) -> None:
        while True:
            at_s = self._cycle * self.machine.period_s
            samples.append(sample(at_s, self._rig.pids, len(samples)))
            await asyncio.sleep(SAMPLE_S)

    def _on_progress(self, progress: Progress) -> None:
        self._cycle = progress.cycle


def leaks(outcomes: list[RunOutcome]) -> list[str]:
    """Return the resources that differ between the first run, which may allocate some, and the last."""
    if len(outcomes) < 2:
        return []
    first, last = outcomes[0].held, outcomes[-1].held
    return [
        f"{name}: {before} after the first run, {after} after the last"
        for name, before, after in zip(HeldResources._fields, first, last, strict=True)
        if before != after
    ]
