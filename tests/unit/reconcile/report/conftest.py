"""The analyses and replays of a report, made once per module."""

import pytest
from report_examples import two_replays, two_views

from reconcile.location.residual_coordinates import ResidualAnalysis
from reconcile.replay.model_replays import ReplayComparison


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> list[ResidualAnalysis]:
    return two_views(tmp_path_factory.mktemp("model"))


@pytest.fixture(scope="module")
def replayed() -> list[ReplayComparison]:
    return two_replays()
