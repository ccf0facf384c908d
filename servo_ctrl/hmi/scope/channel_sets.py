"""Channel sets: what a scope shows and how, by name in one file that all visitors share."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from servo_ctrl.config.file_format import FORMAT, format_problem
from servo_ctrl.errors import ServoCtrlError, reason_of
from servo_ctrl.files.directory import locked
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.scope.capture import TriggerMode
from servo_ctrl.hmi.scope.trigger import TriggerKind
from servo_ctrl.hmi.shell.json_file import read_json_file

FILE = "scope_sets.json"
MAX_SETS = 100
"""Bounds the file and the list that a browser gets."""
MAX_CHARACTERS = 1_000_000
"""Bounds the file of the channel sets; chosen."""
Name = Annotated[str, StringConstraints(max_length=120)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class SetsError(ServoCtrlError):
    """The file of the sets cannot be used."""


class ChannelSet(BaseModel):
    """Channels, their scales and the trigger; levels, limits and offsets in the units named."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    units: Literal["mm", "um", "inch"]
    channels: Annotated[list[Name], Field(max_length=8)]
    span_s: Annotated[Number, Field(gt=0.0, le=60.0)] = 2.0
    kind: TriggerKind = "free"
    source: Name = ""
    level: Number = 0.0
    hysteresis: Number = 0.0
    before_percent: Annotated[Number, Field(ge=0.0, le=100.0)] = 25.0
    mode: TriggerMode = "auto"
    limits: dict[Name, tuple[Number, Number]] = {}
    adjusted: dict[Name, tuple[Number, Number]] = {}
    """Scale and offset by channel."""
    expressions: Annotated[list[Annotated[str, StringConstraints(max_length=200)]], Field(max_length=4)] = []


def _known_format(given: object) -> object:
    if problem := format_problem(given):
        raise ValueError(problem)
    return given


class _SetsFile(BaseModel):
    format: Annotated[Any, AfterValidator(_known_format)] = None
    sets: dict[Name, ChannelSet] = {}


def load_sets(directory: Path) -> dict[str, ChannelSet]:
    """Return the sets by name; none where there is no file. Raises SetsError."""
    path = directory / FILE
    return read_json_file(_SetsFile, path, MAX_CHARACTERS, SetsError).sets if path.exists() else {}


def change_set(directory: Path, name: str, wanted: ChannelSet | None) -> dict[str, ChannelSet]:
    """Keep a set under this name, or remove it with None; return all of them. Raises SetsError."""
    name = name.strip()
    if not name or not name.isprintable() or len(name) > 40:
        raise SetsError(tr("a set needs a name of 1 to 40 characters"))
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with locked(directory):
            sets = load_sets(directory)
            sets.pop(name, None)
            if wanted is not None:
                sets[name] = wanted
            if len(sets) > MAX_SETS:
                raise SetsError(tr("there are {most} sets already: delete one", most=MAX_SETS))
            plain = _SetsFile(format=FORMAT, sets=sets).model_dump(mode="json")
            write_text_whole(directory / FILE, json.dumps(plain, indent=2, ensure_ascii=False) + "\n")
    except OSError as error:
        raise SetsError(f"{directory / FILE}: cannot be written: {reason_of(error)}") from None
    return dict(sorted(sets.items()))
