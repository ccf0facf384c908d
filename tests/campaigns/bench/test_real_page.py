"""The page of the measured axes is what its figures give."""

import json
from pathlib import Path

from tests.campaigns.bench.real_page import page

DOCS = Path(__file__).parents[3] / "docs"


def test_the_page_is_that_of_its_figures() -> None:
    figures = json.loads((DOCS / "reconcile_real.json").read_text(encoding="utf-8"))
    assert page(figures) == (DOCS / "reconcile_real.md").read_text(encoding="utf-8")
