"""Long runs in real time are kept as they end, and a second call makes those that are left."""

import json
from pathlib import Path
from typing import Any

import pytest
import typer

from tests.campaigns.bench.real_time_main import kept_runs, runs_to_make

MACHINE = {"cores": 2}


def kept_file(folder: Path, **changed: Any) -> Path:
    """Write a file of one run of ten minutes."""
    file = folder / "real-time.json"
    content = {"machine": MACHINE, "minutes": 10.0, "runs": [{"policy": "SCHED_FIFO"}]} | changed
    file.write_text(json.dumps(content))
    return file


def test_policies_are_measured_in_turn() -> None:
    policies = ["SCHED_OTHER", "SCHED_FIFO", "SCHED_OTHER"]
    assert list(runs_to_make([], 3)) == policies


def test_runs_of_an_earlier_call_are_not_made_again(tmp_path: Path) -> None:
    made = kept_runs(kept_file(tmp_path), 10.0, MACHINE)
    assert list(runs_to_make(made, 3)) == ["SCHED_OTHER", "SCHED_OTHER"]


def test_without_a_file_there_are_no_earlier_runs(tmp_path: Path) -> None:
    assert kept_runs(tmp_path / "none.json", 10.0, MACHINE) == []


@pytest.mark.parametrize("changed", [{"minutes": 1.0}, {"machine": {"cores": 4}}])
def test_runs_of_other_conditions_are_not_mixed(tmp_path: Path, changed: dict[str, Any]) -> None:
    with pytest.raises(typer.BadParameter, match="another length or computer"):
        kept_runs(kept_file(tmp_path, **changed), 10.0, MACHINE)


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "notes.json"
    file.write_text("[1, 2]")
    with pytest.raises(typer.BadParameter, match="no file of this benchmark"):
        kept_runs(file, 10.0, MACHINE)
