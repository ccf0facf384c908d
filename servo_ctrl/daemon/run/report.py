"""The reports of a run: its progress, its end, and the header of its recording."""

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
"""Format version of recording.json; raised when keys change their meaning."""


class Progress(NamedTuple):
    """The progress of a run. `done` is the completed share of the program or of the strokes, 0..1."""

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
    """The first and the newest events so far."""
    events_count: int
    """Number of all events, including those no longer kept."""


@dataclass(frozen=True, slots=True)
class RunReport:
    """How a run ended; `failed` says whether it was good."""

    machine: str
    completed: bool
    """Whether the last program ran to its end, or all requested learning was done."""
    failed: bool
    signal: str
    """The signal that stopped the run, "" without one."""
    reason: str
    """Why the run stopped before its end, "" when it did not."""
    events: tuple[str, ...]
    cycles: int
    missed_ticks: int
    missing_inputs: int
    wall_s: float
    """Wall-clock time from the first SYNC to the last."""
    spans: tuple[StepSpan, ...]
    """The executed steps and their cycles."""
    lateness: Lateness | None
    """Lateness of the ticks; None in lockstep."""
    recording: Path | None
    learning: LearningStatus
    """Status of the last learning run."""
    outcomes: tuple[LearningOutcome, ...]
    """Results of the last learning run."""
    event_cycles: tuple[int, ...] = ()
    """SYNC cycles since the first, one for each of `events`."""
    cycles_with_missing_inputs: int = 0
    """Cycles in which inputs of any node were missing."""
    first_sync: str = ""
    """Clock time of the first SYNC, ISO 8601; "" where there was none, and in lockstep."""

    def as_header(self) -> dict[str, Any]:
        """Return the keys of recording.json about the end of the run."""
        return {
            "finished": True,
            "completed": self.completed,
            "reason": self.reason or ("" if self.cycles else "it never began"),
            "events": list(self.events),
            "event_cycles": list(self.event_cycles),
            "first_sync": self.first_sync,
            "missed_ticks": self.missed_ticks,
            "missing_inputs": self.missing_inputs,
        }

    def with_problem(self, problem: str) -> "RunReport":
        """Return this report, marked as failed if `problem` names a failure of its recording."""
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
    """Return the contents of recording.json before the first SYNC; see docs/recordings.md."""
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
    """Return the header with the cycles of the steps executed so far."""
    segments = [dict(segment) for segment in header["segments"]]
    for span in spans:
        if span.step >= len(segments):  # a learning stroke, or a repeated program
            segments += [{"label": "not run"} for _ in range(span.step + 1 - len(segments))]
        segments[span.step] = span._asdict()
    return {**header, "segments": segments}
