"""`reconcile diagnose` says `unknown` when it must: foreign physics alone, many noise floors large."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.campaigns.blind.families import trial
from tests.campaigns.blind.families.judge import Drawn, drawn
from tests.campaigns.blind.families.score import scores_of

SEED = 3
"""A training seed, of which the foreign physics is there from the beginning on; not for any score."""
EVERY, SECONDS = 4, 6.0
"""Of the recordings, as a diagnosis of all takes 15 s."""


@pytest.mark.slow
def test_foreign_physics_alone_is_called_unknown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def short(case: trial.Case) -> Drawn:
        made = drawn(case)
        recordings = [
            {name: values[one["time"] < SECONDS][::EVERY] for name, values in one.items()}
            for one in made.recordings
        ]
        return Drawn(recordings, made.truth)

    monkeypatch.setattr("tests.campaigns.blind.families.files.drawn", short)
    [row] = scores_of([trial.one("linear_motor", SEED, "foreign", tmp_path)])
    assert row["foreign_observable"]
    assert row["verdict"] == "unknown"
    assert row["unknown"]
    assert json.loads((tmp_path / "verdict" / "verdict.json").read_text(encoding="utf-8"))["format"] == 1
    assert pq.read_table(tmp_path / "recording_1.parquet").num_rows == int(SECONDS * 2000) // EVERY
