"""Journals of strokes, and the comparison of replayed strokes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from learned_examples import stroke_of
from machine_files import XY_TABLE

from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.stroke_journal import StrokeJournal
from servo_ctrl.learning.types import Stroke, StrokeResult

Entry = tuple[Stroke, StrokeResult]

SETTINGS = learning_settings(load_machine(XY_TABLE), "x")
BASIS: dict[str, float | str] = {"control.kp_1_s": 38.7, "mode": "cst"}


def journal_in(directory: Path, **changes: Any) -> StrokeJournal:
    """Return a journal with some settings changed."""
    return StrokeJournal(directory, "x", SETTINGS._replace(**changes), basis=BASIS)


def filled(directory: Path, strokes: int) -> tuple[StrokeJournal, list[Entry]]:
    """Return a journal with strokes, and these strokes."""
    journal = journal_in(directory)
    entries = [stroke_of(number) for number in range(strokes)]
    for entry in entries:
        journal.append(*entry)
    return journal, entries


def same(found: Sequence[Entry], wanted: Sequence[Entry]) -> bool:
    """Compare strokes and results to the last bit."""
    return len(found) == len(wanted) and all(
        stroke == other
        and result.period_s == theirs.period_s
        and result.error_m.dtype == theirs.error_m.dtype
        and np.array_equal(result.error_m, theirs.error_m)
        for (stroke, result), (other, theirs) in zip(found, wanted, strict=True)
    )
