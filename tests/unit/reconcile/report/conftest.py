"""The analyses and replays of a report, made once per module."""

from pathlib import Path
from typing import Any

import pytest
from report_examples import HOSTILE, two_analyses, two_replays

from reconcile.location.residual_analysis import ResidualAnalysis, located_of_verdict, noise_of_verdict
from reconcile.replay.model_replays import ReplayComparison, replays_json
from reconcile.report.report import write_report


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> list[ResidualAnalysis]:
    return two_analyses(tmp_path_factory.mktemp("model"))


@pytest.fixture(scope="module")
def replayed() -> list[ReplayComparison]:
    return two_replays()


@pytest.fixture(scope="module")
def verdict(views: list[ResidualAnalysis], replayed: list[ReplayComparison]) -> dict[str, Any]:
    level = {"train": 1.0, "heldout": 1.2}
    fit = {"before": level, "refitted": level, "after": {"train": 0.3, "heldout": 0.31}}
    replays = replays_json(replayed, "x")
    return {
        "verdict": "effects",
        "notes": [f"run.csv: {HOSTILE}"],
        "located": located_of_verdict(views),
        "noise_floor": noise_of_verdict(views),
        "findings": [
            {
                "axis": "x",
                "effect": "cogging",
                "confidence": 0.97,
                "equivalent": ["torque_ripple"],
                "where": {"sensor": "force", "axis": "x"},
                "parameters": {"amplitude": {"value": 1.0, "ci95": [0.9, 1.1], "unit": "N"}},
                "gain": 0.5,
                "heldout_gain": 0.5,
                "explanation": f"a force {HOSTILE} repeats",
                "runners_up": [{"effect": "stribeck_friction", "confidence": 0.02, "why_not": HOSTILE}],
            }
        ],
        "not_observable": [{"axis": "x", "effects": ["backlash"], "why": HOSTILE}],
        "fit": {"x": {"force": {"unit": "N", **fit}, "deviation": {"unit": "m", **fit}, "replay": replays}},
        "minor": [{"axis": HOSTILE, "effect": "backlash", "heldout_gain": 0.004, "confidence": 0.6}],
        "next_experiment": {
            "why": HOSTILE,
            "separates": ["cogging", "torque_ripple"],
            "axis": "x",
            "motion": "several accelerations over the same places",
            "accelerations_mm_s2": [100.0, 300.0],
            "tells": HOSTILE,
        },
    }


@pytest.fixture(scope="module")
def report(
    views: list[ResidualAnalysis],
    verdict: dict[str, Any],
    replayed: list[ReplayComparison],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    file: Path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(verdict, views, file, replayed)
    return file
