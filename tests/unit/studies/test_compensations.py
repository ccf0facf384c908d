"""The decision table: figures of the twin, side by side, and the document that shows them."""

import json
import re
from pathlib import Path

import pytest

from studies.compensations import run as study
from studies.compensations.run import markdown
from studies.compensations.twin_study import Row

ROOT = Path(__file__).parents[3]


def test_machines_stand_side_by_side_and_what_was_not_measured_is_a_dash() -> None:
    found = {"a": {"pulse": Row(1.0, 0.25, 3.04)}, "b": {"scale": Row(5.0, 6.0, 7.0)}}
    assert markdown(found).splitlines()[2:] == [
        "| pulse | 1.0 / 0.2 / 3.0 | - |",
        "| scale | - | 5.0 / 6.0 / 7.0 |",
    ]


def test_table_and_figures_are_written_where_nothing_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study, "measured", lambda *_machine: {"scale": Row(5.0, 6.0, 7.0)})
    out, figures = tmp_path / "new" / "out", tmp_path / "figures.json"
    study.run_compensations([Path("a")], out, figures)
    assert "| scale | 5.0 / 6.0 / 7.0 |" in (out / "table.md").read_text(encoding="utf-8")
    assert json.loads(figures.read_text(encoding="utf-8"))["machines"]["a"]["scale"]["peak_um"] == 5.0


def test_the_document_shows_the_figures_that_are_kept_beside_it() -> None:
    kept = json.loads((ROOT / "docs/compensations.json").read_text(encoding="utf-8"))["machines"]
    found = {name: {key: Row(**row) for key, row in rows.items()} for name, rows in kept.items()}
    page = (ROOT / "docs/compensations.md").read_text(encoding="utf-8")
    shown = re.search(r"<!-- figures -->\n(.*?)<!-- end -->", page, re.DOTALL)
    assert shown is not None
    assert shown[1] == markdown(found)
