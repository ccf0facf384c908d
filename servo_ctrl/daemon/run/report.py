"""What a run reports: progress while it goes on, its end, and the header of its recording."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, NamedTuple

from servo_ctrl.commands.learning_status import LearningStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import LearningOutcome
from servo_ctrl.daemon.set_points.reference import StepSpan
from servo_ctrl.io.clock import Lateness
from servo_ctrl.motion.program import Step
from servo_ctrl.recording.channels import Channel

Pacing = Literal["realtime", "lockstep"]
FORMAT = 1
"""Of recording.json; raised when its keys change their meaning."""


class Progress(NamedTuple):
    """Where a run is. `done` is the share of the program that was run, or of the strokes made, 0..1."""

    stage: Stage
    cycle: int
    time_s: float
    """Machine time, seconds since the first SYNC."""
    step: int
    """Index of the program's step, -1 outside the program."""
    label: str
    done: float
    learning: LearningStatus
    events: tuple[str, ...]
    """What has happened so far: the first and the newest."""
    events_count: int
    """How much has happened, with what is not kept."""


@dataclass(frozen=True, slots=True)
class RunReport:
    """How a run ended. It was good when `failed` is False."""

    machine: str
    completed: bool
    """The program was run to its end, the last time; all that was to be learned was learned."""
    failed: bool
    signal: str
    """The signal that stopped it, "" without one."""
    reason: str
    """Why it stopped before the end, "" when it did not."""
    events: tuple[str, ...]
    cycles: int
    missed_ticks: int
    missing_inputs: int
    wall_s: float
    """From the first SYNC to the last, wall clock."""
    spans: tuple[StepSpan, ...]
    """The steps that were run and their cycles."""
    lateness: Lateness | None
    """Of the ticks, in real time."""
    recording: Path | None
    learning: LearningStatus
    """Of the last learning run."""
    outcomes: tuple[LearningOutcome, ...]
    """What it learned."""

    def as_header(self) -> dict[str, Any]:
        """Make the keys of recording.json about the end of the run."""
        return {
            "finished": True,
            "completed": self.completed,
            "reason": self.reason or ("" if self.cycles else "it never began"),
            "events": list(self.events),
            "missed_ticks": self.missed_ticks,
            "missing_inputs": self.missing_inputs,
        }

    def unless(self, problem: str) -> "RunReport":
        """Return the same run, failed if `problem` says what could not be recorded of it."""
        if not problem:
            return self
        return replace(self, failed=True, reason="; ".join(text for text in (self.reason, problem) if text))


def recording_header(
    machine: MachineConfig,
    channels: Iterable[Channel],
    steps: Iterable[Step],
    *,
    program: Path | None,
    pacing: Pacing,
    started: datetime,
) -> dict[str, Any]:
    """Make recording.json before the first SYNC; see docs/recordings.md."""
    return {
        "format": FORMAT,
        "software": f"servo_ctrl {version('servo-ctrl')}",
        "machine": machine.machine.name,
        "axes": list(machine.axes),
        "period_s": machine.period_s,
        "pacing": pacing,
        "started": started.isoformat(timespec="milliseconds"),
        "program": str(program) if program is not None else None,
        "channels": {c.name: {"unit": c.unit, "dtype": c.dtype, "meaning": c.meaning} for c in channels},
        "segments": [{"label": step.label} for step in steps],
        "finished": False,
    }


def with_spans(header: dict[str, Any], spans: Iterable[StepSpan]) -> dict[str, Any]:
    """Add the cycles of the steps that were run so far to the header."""
    segments = [dict(segment) for segment in header["segments"]]
    for span in spans:
        if span.step >= len(segments):  # a stroke of learning, or the program once more
            segments += [{"label": "not run"} for _ in range(span.step + 1 - len(segments))]
        segments[span.step] = span._asdict()
    return {**header, "segments": segments}
