"""Survivors that behave as the file as it is, or need not differ: the list in docs/mutation.md."""

import re
from functools import cache
from pathlib import Path

PAGE = Path(__file__).parents[3] / "docs" / "mutation.md"
ENTRY = re.compile(
    r"^### `(?P<file>[^`]+)`\n+```diff\n(?P<change>.*?)\n```\n+(?P<reason>.+?)(?=\n\n|\Z)",
    re.MULTILINE | re.DOTALL,
)


@cache
def explanations() -> dict[tuple[str, str], str]:
    """(file, change) -> why nobody has to notice."""
    if not PAGE.exists():
        return {}
    text = PAGE.read_text(encoding="utf-8")
    return {(found["file"], found["change"]): found["reason"].strip() for found in ENTRY.finditer(text)}


def explanation_of(file: str, change: str) -> str:
    """The page's words about a survivor, "" where it has none."""
    return explanations().get((file, change), "")
