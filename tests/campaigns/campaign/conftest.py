"""Evidence of a run without violations, for the tests that change one thing in it."""

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
"""Earliest cycle of the fault, so that a current may have been at its limit for long enough before."""


def moving_run() -> Evidence:
    """Return a run with standby in which both axes are fast when the emergency message arrives."""
    for seed in range(20_000):
        plan = draw(seed)
        if (plan.fault.name, plan.state, plan.stand_by, plan.second) == (EMERGENCY, "running", True, None):
            evidence, judgement = worker.run_seed(seed, keep=True)
            assert judgement.violations == ()
            assert judgement.reaction is not None
            assert evidence.injected is not None
            at_fault = evidence.truth.cycle == evidence.injected.cycle
            fast = np.abs(evidence.truth.velocity_m_s[at_fault]).min() > FAST_M_S
            if fast and evidence.injected.cycle > EARLIEST_CYCLE:
                return evidence
            shutil.rmtree(evidence.folder)
    raise AssertionError("no such run")


@pytest.fixture(scope="package")
def whole_run() -> Iterator[Evidence]:
    """An emergency message in motion, which causes a controlled stop; its files exist."""
    evidence = moving_run()
    yield evidence
    shutil.rmtree(evidence.folder)


@pytest.fixture
def evidence(whole_run: Evidence, tmp_path: Path) -> Evidence:
    """The same run with a copy of its files."""
    shutil.copytree(whole_run.folder, tmp_path / "run")
    return whole_run._replace(folder=tmp_path / "run", frames=list(whole_run.frames))
