"""A process that makes runs: warmed up once, then one seed after the other."""

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

LONGEST_S = 120.0
"""A run that takes so long by the wall clock computes for ever."""
MEMORY = Path("/dev/shm")


class TooLongError(Exception):
    """A run that does not come to its end by the wall clock."""


@cache
def machine() -> CampaignMachine:
    """The machine of this process."""
    folder = tempfile.mkdtemp(prefix="campaign-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return make_machine(Path(folder))


def one(seed: int, *, keep: bool = False) -> tuple[Evidence, Judgement]:
    """Make a run and judge it; its folder is gone behind it, unless it is kept."""
    parent = MEMORY if MEMORY.is_dir() else None
    folder = Path(tempfile.mkdtemp(prefix="campaign-", dir=parent))
    before = signal.signal(signal.SIGALRM, _too_long)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_S)
    try:
        evidence = run(draw(seed), machine(), folder)
        return evidence, judge(evidence, machine().controller)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)


def several(seeds: Sequence[int]) -> list[Result]:
    """Make these runs."""
    return [result(seed) for seed in seeds]


def result(seed: int) -> Result:
    """Make a run; what goes wrong in it is its result."""
    plan = draw(seed)
    facts = (seed, plan.fault.name, plan.state, plan.pacing)
    try:
        evidence, judgement = one(seed)
    except Exception as failure:  # noqa: BLE001  # a run that broke is a finding, and no end of the campaign
        return Result(*facts, happened=False, cycles=None, bound=None, violations=(_in_words(failure),))
    seen = judgement.reaction
    cycles, bound = (None, None) if seen is None else seen
    return Result(*facts, evidence.happened is not None, cycles, bound, judgement.violations)


def _in_words(failure: Exception) -> str:
    return f"the run broke: {type(failure).__name__}: {failure}"


def _too_long(_number: int, _frame: Any) -> None:
    raise TooLongError(f"not over after {LONGEST_S:g} s")


def leave_interrupts_to_the_parent() -> None:
    """Ctrl-C goes to all of the terminal's processes; the parent decides."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
