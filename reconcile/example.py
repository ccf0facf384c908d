"""Measured data that others have published, diagnosed: what the two examples share.

The data are not ours to hand on. Each example says who publishes them and where they go.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.errors import ReconcileError
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Sequence

CHECKOUT = Path(__file__).resolve().parents[1]
PLACES = (CHECKOUT.parent / "shared" / "data", Path("data"))
"""Where data sets are looked for: beside the checkout, else in the working directory."""


class Row(NamedTuple):
    """A line of an example's table."""

    figure: str
    ours: str
    mark: str = ""
    """What others published, or what is to be reached."""


class Shown(NamedTuple):
    """What an example shows, and what it left where."""

    title: str
    rows: list[Row]
    values: dict[str, Any]
    """The same as numbers, SI; example.json."""
    files: list[Path]


def data_directory(name: str, given: Path | None) -> Path:
    """As given; else where a data set of this name lies, or would."""
    if given is not None:
        return given
    found = [place / name for place in PLACES if (place / name).is_dir()]
    return found[0] if found else PLACES[-1] / name


def data_file(directory: Path, names: Sequence[str], publisher: str) -> Path:
    """The first of `names` in the directory, or in `orig` in it. Raises ReconcileError with the publisher."""
    for name in names:
        for place in (directory, directory / "orig"):
            if (place / name).is_file():
                return place / name
    raise ReconcileError(directory, "", f"holds no {' or '.join(names)}", publisher)


def write_figures(out: Path, values: dict[str, Any]) -> Path:
    """example.json."""
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(values, indent=1) + "\n"
    write_whole(out / "example.json", lambda temporary: temporary.write_text(text, encoding="utf-8"))
    return out / "example.json"


def reports(*verdict_files: Path) -> list[Path]:
    """What to open: the reports of diagnoses, or their verdicts."""
    pages = [file.with_name("report.html") for file in verdict_files]
    return [page if page.exists() else file for page, file in zip(pages, verdict_files, strict=True)]
