"""The documentation is a site: built once, warnings are errors, every page is there and is found."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(place)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return place


def test_the_site_builds_without_a_warning_and_has_every_page(site: Path) -> None:
    docs = ROOT / "docs"
    for page in docs.rglob("*.md"):
        assert (site / page.relative_to(docs).with_suffix(".html")).is_file(), page


def test_the_reference_is_that_of_docstrings_and_declarations(site: Path) -> None:
    python = (site / "reference" / "python.html").read_text(encoding="utf-8")
    for name in (
        "reconcile.api.diagnose.diagnose",
        "servo_ctrl.client.blocking.Client",
        "hil_sim.bench.bench.Bench",
    ):
        assert f'id="{name}"' in python
    commands = (site / "reference" / "command_lines.html").read_text(encoding="utf-8")
    for name in ("servo-ctrl-run", "hil-sim-run", "reconcile-diagnose", "servo-ctrl-experiment-friction"):
        assert f'id="{name}"' in commands


def test_words_of_the_pages_are_found_and_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    found = {entry["location"].split("#")[0] for entry in index["docs"] if "lubrication" in entry["text"]}
    assert {"watch.html", "plant.html"} <= found
    home = (site / "index.html").read_text(encoding="utf-8")
    assert "fonts.googleapis" not in home


def test_notebooks_are_pages_with_what_they_printed(site: Path) -> None:
    for notebook in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        page = (site / "notebooks" / f"{notebook.stem}.html").read_text(encoding="utf-8")
        assert "verdict.json" in page
        assert re.search(r"_[a-z]+: \d\d%|cogging: \d\d%", page), notebook.name  # printed, not in the code
