"""Every picture of the documents has the command that draws it, and is what that draws."""

import json
import re
import shlex
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from command_parsing import PROGRAMS, parse

from tests.campaigns.pages.pictures import ROOT, TAKES, Drawn, declared, draw

DRAWN, KEPT = declared()
MOST_DIFFERENT = 1e-3
"""Share of the pixels that another processor's arithmetic may shade otherwise."""


def test_every_picture_is_declared_once_and_shown_on_a_page() -> None:
    there = sorted(str(file.relative_to(ROOT / "docs")) for file in (ROOT / "docs").rglob("*.png"))
    drawn = [place for one in DRAWN for place in one.files.values() if place.endswith(".png")]
    assert sorted([*KEPT, *drawn]) == there
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    shown = " ".join(page.read_text(encoding="utf-8") for page in pages)
    assert [
        place for place in there if not re.search(rf"\]\((docs/|\.\./)?{re.escape(place)}\)", shown)
    ] == []


def test_readmes_picture_is_of_a_learning_run_that_meets_the_requirement() -> None:
    figures = json.loads((ROOT / "docs" / "pictures" / "operator_page.json").read_text(encoding="utf-8"))
    before_um, after_um = figures["j_before_um"], figures["j_after_um"]
    assert after_um < figures["j_required_um"] < before_um
    words = f"in {figures['strokes']} strokes, J on a circle fell from {before_um:g} to {after_um:g} um"
    assert words in (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("one", DRAWN, ids=lambda one: one.command)
def test_every_command_is_one_that_there_is(one: Drawn) -> None:
    program, *words = shlex.split(one.command)
    assert one.takes in TAKES
    if program in PROGRAMS:
        parse([program, *words])
    else:
        assert (ROOT / f"{words[1].replace('.', '/')}.py").is_file()


@pytest.mark.parametrize("one", [one for one in DRAWN if one.takes == "seconds"], ids=lambda one: one.command)
def test_a_picture_is_what_its_command_draws(one: Drawn, tmp_path: Path) -> None:
    assert draw(one, tmp_path) == list(one.files.values())
    assert draw(one, tmp_path) == []  # the same bytes again
    for place in one.files.values():
        new, old = (matplotlib.image.imread(folder / place) for folder in (tmp_path, ROOT / "docs"))
        assert new.shape == old.shape
        assert np.mean(np.any(new != old, axis=2)) < MOST_DIFFERENT, f"{place}: make pages"
