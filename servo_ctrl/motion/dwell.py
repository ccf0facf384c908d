"""Standing still."""

from typing import NamedTuple


class Dwell(NamedTuple):
    """How long, seconds (> 0)."""

    label: str
    duration_s: float
