"""The files of `servo-ctrl tune`: found below directories, and checked, for another program wrote them."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.files.tuning_files import BODE_FILE, FIGURES_FILE
from servo_ctrl.hmi.shell.json_file import read_json_file

MAX_CHARACTERS = 10_000_000
"""Bounds tune.json and bode.json; chosen: a tuning has about 5 kB of figures and 500 kB of curves."""
MAX_TUNINGS, SEARCH_DEPTH = 50, 2
"""Bounds of the list that a browser gets, and of the levels of directories that are searched."""

Text = Annotated[str, StringConstraints(max_length=4000)]
Quantity = float | None
"""None: not finite, or not determined."""


class TuningError(ServoCtrlError):
    """The files of a tuning cannot be used."""


class _TuningPart(BaseModel):
    # keys that the page does not show are ignored, so that later versions may add to them
    model_config = ConfigDict(frozen=True, extra="ignore")


class TunedSetting(_TuningPart):
    """Margins of a setting on the measured plant, and the indicators of its trial."""

    stable: bool
    sensitivity_peak: Quantity
    peak_hz: Quantity
    phase_margin_deg: Quantity
    gain_margin_db: Quantity
    crossover_hz: Quantity
    compliance_m_n: Quantity
    remark: Text = ""
    step_peak_m: Quantity = None
    step_settling_s: Quantity = None
    move_peak_m: Quantity = None
    move_settling_s: Quantity = None
    circle_peak_m: Quantity = None
    circle_rms_m: Quantity = None


class TuningFigures(_TuningPart):
    """The part of tune.json that the page shows."""

    machine: Text
    axis: Text
    stated_ms: float
    measured_ms: float
    proved: bool
    simulated: bool = False
    """On a simulator instead of the machine."""
    proposed: dict[Text, dict[Text, bool | float | Text]]
    before: TunedSetting
    after: TunedSetting
    notes: Annotated[list[Text], Field(max_length=1000)] = []


class BodeCurve(_TuningPart):
    """A frequency response, (n,) each."""

    name: Text
    frequency_hz: list[float]
    magnitude: list[float]
    phase_deg: list[float]


class BodeCurves(_TuningPart):
    """The content of bode.json."""

    plant: Annotated[list[BodeCurve], Field(max_length=20)]
    """Position per force, m/N."""
    loop: Annotated[list[BodeCurve], Field(max_length=20)]


class Tuning(NamedTuple):
    """A tuning that was found."""

    directory: Path
    written: datetime

    @property
    def place(self) -> str:
        """The last two parts of its path."""
        return "/".join(self.directory.parts[-2:])


def tunings_below(directories: Sequence[Path]) -> list[Tuning]:
    """Return at most MAX_TUNINGS tunings in directories and below them, the newest first."""
    found = {}
    for directory in directories:
        for file in islice(_figures_below(directory, SEARCH_DEPTH), MAX_TUNINGS):
            try:
                written = datetime.fromtimestamp(file.stat().st_mtime, UTC)
            except OSError:
                continue  # it has just been removed
            found[file.resolve()] = Tuning(file.parent, written)
    return sorted(found.values(), key=lambda one: one.written, reverse=True)[:MAX_TUNINGS]


def read_figures(directory: Path) -> TuningFigures:
    """Read tune.json. Raises TuningError."""
    return read_json_file(TuningFigures, directory / FIGURES_FILE, MAX_CHARACTERS, TuningError)


def read_curves(directory: Path) -> BodeCurves | None:
    """Read bode.json; None where there is none. Raises TuningError."""
    path = directory / BODE_FILE
    return read_json_file(BodeCurves, path, MAX_CHARACTERS, TuningError) if path.exists() else None


def _figures_below(directory: Path, depth: int) -> Iterator[Path]:
    """Yield the tune.json of a directory and of those below it; symbolic links are not followed."""
    try:
        if (directory / FIGURES_FILE).is_file():
            yield directory / FIGURES_FILE
        below = sorted(one for one in directory.iterdir() if one.is_dir() and not one.is_symlink())
    except OSError:
        return
    if depth:
        for one in below:
            yield from _figures_below(one, depth - 1)
