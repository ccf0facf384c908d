"""Every picture of the documents has the command that draws it, and is what that draws."""

import json
import re
import shlex
import shutil
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
    drawn = (place for one in DRAWN for place in one.files.values() if place.endswith(".png"))
    assert sorted([*KEPT, *drawn]) == there
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    shown = " ".join(page.read_text(encoding="utf-8") for page in pages)
    assert [
        place for place in there if not re.search(rf"\]\((docs/|\.\./)?{re.escape(place)}\)", shown)
    ] == []


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
    for place in one.files.values():
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / "docs" / place, tmp_path / place)
    changed = draw(one, tmp_path)
    for place in changed:  # another processor's arithmetic; else the committed bytes were drawn again
        new, old = (matplotlib.image.imread(folder / place) for folder in (tmp_path, ROOT / "docs"))
        assert new.shape == old.shape
        assert np.mean(np.any(new != old, axis=2)) < MOST_DIFFERENT, f"{place}: make pages"
    assert not changed or draw(one, tmp_path) == []


def test_readme_shows_a_learning_run_that_reaches_what_is_required() -> None:
    """By the figures that were written with the picture (readme_picture.py)."""
    figures = json.loads((ROOT / "docs/pictures/operator_page.json").read_text(encoding="utf-8"))
    assert figures["J_after_um"] < figures["J_required_um"] < figures["J_before_um"]
    assert (
        f"X has learned in {figures['strokes']} strokes, J on a circle fell from {figures['J_before_um']:g} "
        f"to {figures['J_after_um']:g} um with {figures['J_required_um']:g} um required"
    ) in (ROOT / "README.md").read_text(encoding="utf-8")
