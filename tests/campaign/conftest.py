"""Evidence of a good run, for the tests that make one thing in it bad."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from tests.campaign import worker
from tests.campaign.draw import draw

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.campaign.run import Evidence


def moving_seed() -> int:
    """A run of the program that stands by."""
    return next(
        seed
        for seed in range(20_000)
        if draw(seed).fault.name == "emergency message"
        and draw(seed).state == "running"
        and draw(seed).stand_by
        and draw(seed).second is None
    )


@pytest.fixture(scope="package")
def whole_run() -> Iterator[Evidence]:
    """An emergency message in motion: a controlled stop. Its files are there."""
    evidence, judgement = worker.one(moving_seed(), keep=True)
    assert judgement.violations == ()
    assert judgement.reaction is not None
    yield evidence
    shutil.rmtree(evidence.folder)


@pytest.fixture
def evidence(whole_run: Evidence, tmp_path: Path) -> Evidence:
    """The same with files of its own."""
    shutil.copytree(whole_run.folder, tmp_path / "run")
    return whole_run._replace(folder=tmp_path / "run", frames=list(whole_run.frames))
