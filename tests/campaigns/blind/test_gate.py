"""A small fixed set of cases whose scores may not fall; their seeds are never published."""

import json
from pathlib import Path

from typer.testing import CliRunner

from reconcile.cli.main import app
from reconcile.trials.seeds import FIRST_SCORED_SEED
from reconcile.trials.summary import summary
from reconcile.trials.trial import trials

SEEDS = (9038, 9046, 9047, 9055, 9069, 9076)
"""Two recordings each; chosen for their shortness before any was diagnosed."""
LEAST = {"named_at_all": 0.5, "achieved_gain": 0.5}
"""Bound scores from below; chosen under the bars of the page, as six cases vary by chance."""
MOST = {"failed": 0.0}
"""Bound scores from above."""


def test_scores_do_not_fall_far() -> None:
    assert max(SEEDS) < FIRST_SCORED_SEED
    rows = list(trials(SEEDS, "tests.campaigns.blind", 2, lambda _seal: None))
    details = [(row["seed"], row["error"], row["planted"], row["findings"]) for row in rows]
    scores = summary(rows)["scores"]
    for name, bar in MOST.items():
        assert scores[name]["value"] <= bar, (name, scores[name], details)
    for name, bar in LEAST.items():
        assert scores[name]["value"] >= bar, (name, scores[name], details)


def test_the_hash_is_printed_before_the_truth_and_the_page_labels_training_seeds(tmp_path: Path) -> None:
    file, page = tmp_path / "scores.json", tmp_path / "page.md"
    asked = ["trial", "--seed", "9036", "--cases", "1", "--json", str(file), "--page", str(page)]
    result = CliRunner().invoke(app, asked)
    assert result.exit_code == 0, result.output
    content = json.loads(file.read_text(encoding="utf-8"))
    [row] = content["rows"]
    assert result.output.index(row["sha256"]) < result.output.index(f"{row['seed']}: {row['kind']}")
    assert content["scored"] is False
    assert "These are training seeds: no proof." in page.read_text(encoding="utf-8")
    assert page.with_suffix(".png").stat().st_size > 1000
