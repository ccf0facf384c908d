"""Evidence of a good run, for the tests that make one thing in it bad."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.campaigns.campaign import worker
from tests.campaigns.campaign.draw import draw

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.campaigns.campaign.run import Evidence


EMERGENCY = "emergency message"
FAST_M_S = 0.02
EARLIEST_CYCLE = 120
"""So that a current may have been at its limit for long enough before."""


def moving_run() -> Evidence:
    """A run of the program that stands by, both of its axes fast when the emergency message comes."""
    for seed in range(20_000):
        plan = draw(seed)
        if (plan.fault.name, plan.state, plan.stand_by, plan.second) == (EMERGENCY, "running", True, None):
            evidence, judgement = worker.one(seed, keep=True)
            assert judgement.violations == ()
            assert judgement.reaction is not None
            assert evidence.happened is not None
            then = evidence.truth.cycle == evidence.happened[1]
            fast = np.abs(evidence.truth.velocity_m_s[then]).min() > FAST_M_S
            if fast and evidence.happened[1] > EARLIEST_CYCLE:
                return evidence
            shutil.rmtree(evidence.folder)
    raise AssertionError("no such run")


@pytest.fixture(scope="package")
def whole_run() -> Iterator[Evidence]:
    """An emergency message in motion: a controlled stop. Its files are there."""
    evidence = moving_run()
    yield evidence
    shutil.rmtree(evidence.folder)


@pytest.fixture
def evidence(whole_run: Evidence, tmp_path: Path) -> Evidence:
    """The same with files of its own."""
    shutil.copytree(whole_run.folder, tmp_path / "run")
    return whole_run._replace(folder=tmp_path / "run", frames=list(whole_run.frames))
