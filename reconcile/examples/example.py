"""Common parts of the examples: the directories of published data, and the table of results.

The data are not part of this project; each example names their publisher and the place for them.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from reconcile.errors import ReconcileError
from servo_ctrl.files.diagnosis_files import REPORT_FILE
from servo_ctrl.files.whole_file import write_text_whole

CHECKOUT = Path(__file__).resolve().parents[2]
PLACES = (CHECKOUT.parent / "shared" / "data", Path("data"))
"""Searched directories of data sets: beside the checkout, else in the working directory."""


class Row(NamedTuple):
    """A row of an example's table."""

    figure: str
    ours: str
    mark: str = ""
    """Published value, or the value to reach."""


class ExampleResult(NamedTuple):
    """The results of an example, and the files that it wrote."""

    title: str
    rows: list[Row]
    values: dict[str, Any]
    """The content of example.json; SI."""
    files: list[Path]


def data_directory(name: str, given: Path | None) -> Path:
    """Return the given directory, else the first place with the data set, else the place for it."""
    if given is not None:
        return given
    found = [place / name for place in PLACES if (place / name).is_dir()]
    return found[0] if found else PLACES[-1] / name


def data_file(directory: Path, names: Sequence[str], publisher: str) -> Path:
    """Return the first of `names` in the directory or its `orig`. Raises ReconcileError: none is there."""
    for name in names:
        for place in (directory, directory / "orig"):
            if (place / name).is_file():
                return place / name
    raise ReconcileError(directory, "", f"holds no {' or '.join(names)}", publisher)


def write_figures(out: Path, values: dict[str, Any]) -> Path:
    """Write example.json. Raises OSError."""
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(values, indent=1) + "\n"
    write_text_whole(out / "example.json", text)
    return out / "example.json"


def reports(*verdict_files: Path) -> list[Path]:
    """Return the reports of diagnoses, or their verdicts where there is no report."""
    pages = [file.with_name(REPORT_FILE) for file in verdict_files]
    return [page if page.exists() else file for page, file in zip(pages, verdict_files, strict=True)]
