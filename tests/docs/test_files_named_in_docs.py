"""Every source file that a page names exists: a move that forgets a page fails here."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NAMED = re.compile(r"(?<![\w/.])((?:[a-z_0-9]+/)+[a-z_0-9]+\.py)\b")


def sources() -> list[str]:
    ours = (
        "kernels",
        "servo_ctrl",
        "hil_sim",
        "local_can",
        "can_frames",
        "twin",
        "reconcile",
        "studies",
        "shipped_files",
    )
    rooms = (*ours, "tests")
    return [f"/{path.relative_to(ROOT)}" for room in rooms for path in (ROOT / room).rglob("*.py")]


@pytest.fixture(scope="module")
def existing() -> list[str]:
    return sources()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_source_file_that_a_page_names_exists(page: Path, existing: list[str]) -> None:
    named = set(NAMED.findall(page.read_text(encoding="utf-8")))
    assert not [name for name in sorted(named) if not any(path.endswith(f"/{name}") for path in existing)]


def test_each_decision_has_a_number_of_its_own() -> None:
    numbers = sorted(path.name[:4] for path in (ROOT / "docs" / "decisions").glob("*.md"))
    assert numbers == [f"{number:04}" for number in range(1, len(numbers) + 1)]
