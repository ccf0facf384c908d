"""Which seeds of this generator have been scored: `reconcile trial` asks before it draws."""

from pathlib import Path

from tests.campaigns.blind.families import seeds

NAME = "older"
FILE = Path(__file__).with_name("used_seeds.json")


def claim(first: int, count: int) -> bool:
    """Write down that these seeds are looked at now; return whether they may be scored.

    Raises:
        ValueError: some were looked at before, or the range is of both sorts.
    """
    return seeds.claim(NAME, first, count, FILE)
