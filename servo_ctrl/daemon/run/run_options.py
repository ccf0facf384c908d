"""Options of a run, and of one that learns."""

from pathlib import Path
from typing import NamedTuple

from servo_ctrl.daemon.learning.learned_compensation import Compensation


class LearningRequest(NamedTuple):
    """A run that learns and ends; no axes = all that can learn, no learner = the machine file's."""

    axes: tuple[str, ...] = ()
    learner: str | None = None
    fresh: bool = False
    """Discard the strokes of an interrupted earlier run."""


class RunOptions(NamedTuple):
    """Options of a run; see `supervisor.run_machine`."""

    serve: bool
    learned_dir: Path | None
    compensation: Compensation
    learn: LearningRequest | None
    stand_by: bool = False
    """Whether a stop ends in standby instead of ending the run."""
