"""The shortened positioning study, by the command of a user: bus and twin give the same readings."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT_S = 800.0  # each of 100,000 turns in lockstep waits for others that want the processors


def test_the_positioning_study_reads_the_same_over_the_bus_and_in_the_twin(tmp_path: Path) -> None:
    done = subprocess.run(
        [
            *(str(Path(sys.executable).with_name("servo-ctrl")), "experiment", "positioning"),
            *("--machine", str(ROOT / "machines" / "precision_stage"), "--out", str(tmp_path)),
            *("--json", str(tmp_path / "p.json"), "--runs", "2", "--points", "3"),
            *("--stage", "screw_table_sampled"),
            *("--bus-points", "1", "--bus-runs", "1"),
        ],
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
        env={**os.environ, "COLUMNS": "100"},
    )
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-2000:]
    figures = json.loads((tmp_path / "p.json").read_text(encoding="utf-8"))
    assert list(figures["bus"]) == ["screw_table_sampled"]
    assert figures["bus"]["screw_table_sampled"]["readings"] == 2
    assert figures["bus"]["screw_table_sampled"]["largest_difference_um"] == 0.0
    assert figures["at_100mm"]["screw_table_sampled_um"] <= 1.14
    assert figures["iso_230_2"]["screw_table_sampled"]["A_um"] > 0.0
    assert "Wang et al. 2014" in done.stdout
    assert "positioning in the batch twin: 100 %" in done.stderr
    for name in ("at_100mm", "over_travel"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert (tmp_path / "learned" / "x" / "screw").is_dir(), "what the bus run used"
