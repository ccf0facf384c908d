"""A worker process, which makes the runs of a list of seeds on one machine."""

from __future__ import annotations

import atexit
import shutil
import signal
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.campaigns.campaign.draw import draw
from tests.campaigns.campaign.journal import Result
from tests.campaigns.campaign.machine import make_machine
from tests.campaigns.campaign.oracles import judge
from tests.campaigns.campaign.run import Evidence, run

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.campaigns.campaign.machine import CampaignMachine
    from tests.campaigns.campaign.oracles import Judgement

RUN_WALL_TIME_MAX_S = 120.0
"""Wall-clock time after which a run counts as endless, seconds; chosen."""
MEMORY_FOLDER = Path("/dev/shm")


class TooLongError(Exception):
    """A run exceeded its wall-clock time."""


@cache
def machine() -> CampaignMachine:
    """Return the machine of this process."""
    folder = tempfile.mkdtemp(prefix="campaign-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return make_machine(Path(folder))


def run_seed(seed: int, *, keep: bool = False) -> tuple[Evidence, Judgement]:
    """Make a run and judge it; delete its folder unless `keep`."""
    parent = MEMORY_FOLDER if MEMORY_FOLDER.is_dir() else None
    folder = Path(tempfile.mkdtemp(prefix="campaign-", dir=parent))
    before = signal.signal(signal.SIGALRM, _raise_too_long)
    signal.setitimer(signal.ITIMER_REAL, RUN_WALL_TIME_MAX_S)
    try:
        evidence = run(draw(seed), machine(), folder)
        return evidence, judge(evidence, machine().controller)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)


def run_seeds(seeds: Sequence[int]) -> list[Result]:
    """Make the runs of these seeds."""
    return [result(seed) for seed in seeds]


def result(seed: int) -> Result:
    """Make a run; return its result, also if the run raised an exception."""
    plan = draw(seed)
    facts = (seed, plan.fault.name, plan.state, plan.pacing)
    try:
        evidence, judgement = run_seed(seed)
    except Exception as exception:  # noqa: BLE001  # an exception is a violation and does not end the campaign
        return Result(
            *facts, injected=False, cycles=None, bound=None, violations=(_violation_text(exception),)
        )
    seen = judgement.reaction
    cycles, bound = (None, None) if seen is None else seen
    return Result(*facts, evidence.injected is not None, cycles, bound, judgement.violations)


def _violation_text(exception: Exception) -> str:
    return f"the run broke: {type(exception).__name__}: {exception}"


def _raise_too_long(_number: int, _frame: Any) -> None:
    raise TooLongError(f"not over after {RUN_WALL_TIME_MAX_S:g} s")


def leave_interrupts_to_the_parent() -> None:
    """Ignore Ctrl-C, which reaches all processes of the terminal, so that the parent handles it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
