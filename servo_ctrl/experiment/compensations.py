"""All compensations on all machines, run by the batch twin: the figures of the decision table."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.experiment.twin_process import TwinError, run_twin

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

TWIN_LIMIT_S = 600.0
"""A machine takes half a minute on two idle cores."""
FIGURES = ("peak_um", "rms_um", "endpoint_um")


class Row(NamedTuple):
    """What a variant shows by the scale, micrometres."""

    peak_um: float
    rms_um: float
    endpoint_um: float


def measured(machine: Path, out: Path, on_line: Callable[[str], None]) -> dict[str, Row]:
    """Run all variants on one machine. Raises ServoCtrlError."""
    file = out / f"{machine.name}.json"
    arguments = ["--machine", str(machine), "--json", str(file)]
    run_twin("reconcile.compensation_study", arguments, TWIN_LIMIT_S, on_line)
    try:
        variants = json.loads(file.read_text(encoding="utf-8"))["variants"]
        return {name: Row(*(float(entry[key]) for key in FIGURES)) for name, entry in variants.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise TwinError(f"{file}: is no list of the twin's figures: {error!r}") from None


def markdown(found: Mapping[str, Mapping[str, Row]]) -> str:
    """A table of all machines side by side: peak / RMS / end point, micrometres."""
    names = dict.fromkeys(variant for rows in found.values() for variant in rows)
    lines = [
        f"| what acts | {' | '.join(found)} |",
        f"|---|{'---|' * len(found)}",
    ]
    for variant in names:
        cells = [_cell(rows.get(variant)) for rows in found.values()]
        lines.append(f"| {variant} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _cell(row: Row | None) -> str:
    return "-" if row is None else " / ".join(f"{value:.1f}" for value in row)
