"""The decision table: figures of the twin, side by side, and the document that shows them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from servo_ctrl.experiment import compensations
from servo_ctrl.experiment.compensations import Row, markdown, measured
from servo_ctrl.experiment.twin_process import TwinError

ROOT = Path(__file__).parents[3]


def test_machines_stand_side_by_side_and_what_was_not_measured_is_a_dash() -> None:
    found = {"a": {"pulse": Row(1.0, 0.25, 3.04)}, "b": {"scale": Row(5.0, 6.0, 7.0)}}
    assert markdown(found).splitlines()[2:] == [
        "| pulse | 1.0 / 0.2 / 3.0 | - |",
        "| scale | - | 5.0 / 6.0 / 7.0 |",
    ]


@pytest.mark.parametrize(
    "text", [None, "{", "[]", '{"variants": {"x": {"peak_um": 1}}}', '{"variants": {"x": 3}}']
)
def test_a_list_of_figures_that_is_none_is_named(
    text: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def pretended(*_arguments: object) -> None:
        if text is not None:
            (tmp_path / "m.json").write_text(text, encoding="utf-8")

    monkeypatch.setattr(compensations, "run_twin", pretended)
    with pytest.raises(TwinError, match=r"m\.json: is no list of the twin's figures"):
        measured(Path("m"), tmp_path, lambda _line: None)


def test_the_document_shows_the_figures_that_are_kept_beside_it() -> None:
    kept = json.loads((ROOT / "docs/compensations.json").read_text(encoding="utf-8"))["machines"]
    found = {name: {key: Row(**row) for key, row in rows.items()} for name, rows in kept.items()}
    page = (ROOT / "docs/compensations.md").read_text(encoding="utf-8")
    shown = re.search(r"<!-- figures -->\n(.*?)<!-- end -->", page, re.DOTALL)
    assert shown is not None
    assert shown[1] == markdown(found)
