"""A soak: the same production again and again, and after each run the counts and resources are compared.

The hub and the simulator live through all of it; each run boots the nodes, homes, makes parts, stops and
closes its recording, as a shift does. What a run leaves behind shows in the next.
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
PART_S = 4.712389  # a turn of R = 25 mm at F = 2000 mm/min
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
    """A program that lasts for about this machine time."""
    return PROGRAM.format(turns=max(round(machine_s / PART_S, 2), 0.25))


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
    def stopped(self) -> str:
        """The reason that ended it before its program did, and "" where none has."""
        whole = self.report.completed and not self.report.failed
        return "" if whole else self.report.reason or "it ended, and says nothing"

    @property
    def faults(self) -> list[str]:
        """What should not be, in words. In real time the computer may be too busy, and the policy stops."""
        return [*([self.stopped] if self.stopped and not self.realtime else []), *self.counts.faults]

    def as_json(self) -> dict[str, Any]:
        return {
            "machine_s": round(self.machine_s, 6),
            "wall_s": round(self.report.wall_s, 3),
            "books": self.counts.as_json(),
            "stopped": self.stopped,
            "missing_inputs": self.report.missing_inputs,
            "events": list(self.report.events),
            "held": self.held._asdict(),
            "faults": self.faults,
        }


class Recordings:
    """Where recordings go: the last ones stay, the disk does not fill."""

    def __init__(self, folder: Path, kept: int) -> None:
        self._folder, self._kept = folder, kept
        self._present: deque[Path] = deque()
        self._count = 0
        self.bytes = 0
        """Written so far, those that are gone too."""

    def next(self) -> Path:
        """A directory that is not there yet; the eldest beyond those kept goes."""
        while len(self._present) >= max(self._kept, 1):
            shutil.rmtree(self._present.popleft())
        self._count += 1
        directory = self._folder / f"run-{self._count:06d}"
        self._present.append(directory)
        return directory

    def present(self) -> list[Path]:
        """Those that are on the disk."""
        return sorted(self._folder.glob("run-*"))

    def measure(self, directory: Path) -> None:
        """Count what a finished recording takes."""
        self.bytes += sum(file.stat().st_size for file in directory.iterdir())


class Soak:
    """Runs on a rig, with a station that counts."""

    def __init__(
        self,
        machine: MachineConfig,
        folder: Path,
        pacing: Pacing,
        *,
        fifo: bool = False,
        kept: int = 2,
    ) -> None:
        self.machine = machine
        self.pacing, self._fifo, self._folder = pacing, fifo, folder
        self.recordings = Recordings(folder, kept)
        self._cycle = 0

    def stand_on(self, rig: Rig, station: Station) -> None:
        """Where the next runs are made, and who counts."""
        self._rig, self._station = rig, station

    async def run(self, machine_s: float) -> RunOutcome:
        """One run of about this length. Raises ServoCtrlError where it does not begin."""
        file = self._folder / "production.toml"
        file.write_text(program_text(machine_s), encoding="utf-8")
        program = load_program(file, self.machine)
        directory = self.recordings.next()
        await self._station.ask("begin")
        samples: list[Sample] = []
        watching = asyncio.create_task(self._watch(samples))
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
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
        counted = await self._settled()
        realtime = self.pacing == "realtime"
        outcome = RunOutcome(
            report,
            compare_counts(report, counted, directory, answers_may_lack=realtime),
            held_resources(),
            tuple(samples),
            self.machine.period_s,
            realtime,
        )
        self.recordings.measure(directory)
        return outcome

    async def _settled(self) -> dict[str, Any]:
        """The station's counts once nothing comes any more: what is on its way is counted too."""
        before: dict[str, Any] = {}
        for _ in range(20):
            counted = await self._station.ask("count")
            if counted["frames"].get("080") == before.get("080"):
                return counted
            before = counted["frames"]
            await asyncio.sleep(0.1)
        return counted

    async def _watch(self, samples: list[Sample]) -> None:
        while True:
            at_s = self._cycle * self.machine.period_s
            samples.append(sample(at_s, self._rig.pids, len(samples)))
            await asyncio.sleep(SAMPLE_S)

    def _on_progress(self, progress: Progress) -> None:
        self._cycle = progress.cycle


def leaks(outcomes: list[RunOutcome]) -> list[str]:
    """What the process holds after the last run and did not after the first: the first may set things up."""
    if len(outcomes) < 2:
        return []
    first, last = outcomes[0].held, outcomes[-1].held
    return [
        f"{name}: {before} after the first run, {after} after the last"
        for name, before, after in zip(HeldResources._fields, first, last, strict=True)
        if before != after
    ]
