"""One short recording of each family through `reconcile diagnose`: what it conceals is named, no more.

Linear motor: `test_unknown.py`, of which the physics has no name.
"""

from pathlib import Path

import pytest

from tests.campaigns.blind.families import trial
from tests.campaigns.blind.families.judge import Drawn, drawn
from tests.campaigns.blind.families.score import scores_of

PERIOD_S, SECONDS = 0.004, 6.0
"""Of the recording, the case's first: a diagnosis of all of them takes a minute."""
CASES = {
    "ball_screw": (1003, {"stribeck_friction"}),
    "belt_drive": (1005, {"lead_error_cumulative"}),
    "rack_and_pinion": (1003, {"constant_force", "thermal_expansion"}),
    "robot_joint": (1000, {"asymmetric_coulomb_friction"}),
}
"""Training seeds, chosen because they were right: they hold that nothing gets worse, and are not a score."""


def short(case: trial.Case) -> Drawn:
    """Return a case with its first recording alone, its first seconds thinned out."""
    made = drawn(case)
    run = made.recordings[0]
    every = round(PERIOD_S / (run["time"][1] - run["time"][0]))
    return Drawn([{name: values[run["time"] < SECONDS][::every] for name, values in run.items()}], made.truth)


@pytest.mark.slow
@pytest.mark.parametrize("family", CASES)
def test_what_a_family_conceals_is_named(
    family: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.campaigns.blind.families.files.drawn", short)
    seed, named = CASES[family]
    [row] = scores_of([trial.one(family, seed, None, tmp_path)])
    assert {name for name, right in row["right"].items() if right} >= named
    assert row["false"] == []
