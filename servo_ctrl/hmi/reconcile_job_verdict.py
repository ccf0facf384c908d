"""verdict.json of `reconcile`, checked and put into words: another program wrote it."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.file_format import format_problem

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

LARGEST_VERDICT = 10_000_000
"""Characters; they have some ten thousand."""

Text = Annotated[str, StringConstraints(max_length=4000)]
Quantity = float | None
"""None: NaN in the file, as where nothing could be said."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]

WORDS = {
    "effects": (
        "The model leaves out physics of the catalogue.",
        "Read the findings, then accept the model.",
    ),
    "parameters": ("The model's physics is right, its values are not.", "Accept the model."),
    "consistent": ("Model and recordings agree: what is left is noise.", "Nothing is to be done."),
    "unknown": (
        "There is something real that nothing in the catalogue explains.",
        "Look in the report where it lives.",
    ),
}
"""By verdict: what it says, and what to do."""
SENSES = {"force": "motor force", "deviation": "scale less motor"}
UNIT_ENDS = ("_n_s2_m2", "_n_s_m", "_m_s", "_n_m", "_m_n", "_rad", "_hz", "_n", "_m", "_s")
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


class VerdictError(ServoCtrlError):
    """A verdict.json that cannot be used."""


class _Part(BaseModel):
    # what the page does not show is none of its business; later versions of reconcile may add to it
    model_config = ConfigDict(frozen=True, extra="ignore")


class Parameter(_Part):
    """A value of an effect, SI."""

    value: Quantity
    ci95: tuple[Quantity, Quantity]
    unit: Text


class Rival(_Part):
    """What was tried in place of a finding."""

    effect: Text
    confidence: Quantity
    why_not: Text


class Finding(_Part):
    """An effect that the model leaves out."""

    axis: Text
    effect: Text
    confidence: Share | None
    equivalent: list[Text] = []
    parameters: dict[Text, Parameter] = {}
    heldout_gain: Quantity
    explanation: Text
    runners_up: list[Rival] = []


class Level(_Part):
    """RMS on blocks that were fitted and on others."""

    train: Quantity
    heldout: Quantity


class Sense(_Part):
    """How well the models describe one difference."""

    unit: Literal["N", "m"]
    before: Level
    refitted: Level
    after: Level


class AxisFit(_Part):
    """Of one axis, by sense."""

    force: Sense | None = None
    deviation: Sense | None = None


class Verdict(_Part):
    """As much of it as the page shows."""

    verdict: Literal["effects", "parameters", "consistent", "unknown"]
    notes: Annotated[list[Text], Field(max_length=1000)] = []
    findings: Annotated[list[Finding], Field(max_length=1000)]
    fit: dict[Text, AxisFit]


class Improvement(NamedTuple):
    """RMS of what the models miss on blocks that were held out, in `unit`."""

    axis: str
    sense: str
    unit: str
    before: float
    refitted: float
    after: float


def read_verdict(path: Path) -> Verdict:
    """The verdict of a diagnosis. Raises VerdictError naming file and key."""
    try:
        with path.open(encoding="utf-8") as file:
            text = file.read(LARGEST_VERDICT + 1)
        if len(text) > LARGEST_VERDICT:
            raise VerdictError(f"{path}: has more than {LARGEST_VERDICT} characters")
        content = json.loads(text, parse_constant=_no_number)
        if isinstance(content, dict) and (problem := format_problem(content.get("format"))):
            raise VerdictError(f"{path}: {problem}")
        return Verdict.model_validate(content)
    except OSError as error:
        raise VerdictError(f"{path}: cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise VerdictError(f"{path}: {key}: {first['msg']}") from None
    except (ValueError, RecursionError) as error:
        raise VerdictError(f"{path}: is no JSON: {error}") from None


def improvements(verdict: Verdict) -> Iterator[Improvement]:
    """Before and after of each axis and sense that has them, in a unit that one reads."""
    for axis, fit in verdict.fit.items():
        for name, sense in (("force", fit.force), ("deviation", fit.deviation)):
            if sense is None:
                continue
            levels = [sense.before.heldout, sense.refitted.heldout, sense.after.heldout]
            known = [math.nan if level is None else level for level in levels]
            factor, unit = _reading(known[0], sense.unit)
            yield Improvement(axis, SENSES[name], unit, *(level / factor for level in known))


def parameter_text(parameter: Parameter) -> str:
    """`3.02 µm (2.95 to 3.1)`."""
    if parameter.value is None:
        return "-"
    factor, unit = _reading(parameter.value, parameter.unit)
    text = f"{parameter.value / factor:.3g} {unit}".rstrip()
    low, high = parameter.ci95
    if low is None or high is None or low == high:
        return text
    return f"{text} ({low / factor:.3g} to {high / factor:.3g})"


def title(name: str) -> str:
    """`drive_compliance` as a reader has it."""
    return name.replace("_", " ").replace("stribeck", "Stribeck")


def parameter_name(key: str) -> str:
    """`viscous_n_s_m` is viscous: its unit stands beside the value."""
    for end in UNIT_ENDS:
        stem = key.removesuffix(end)
        if stem and stem != key:
            return title(stem)
    return title(key)


def percent(share: float | None) -> str:
    """Never rounded to certainty."""
    if share is None:
        return "-"
    if share >= 0.995:
        return "> 99 %"
    return "< 1 %" if share < 0.005 else f"{100.0 * share:.0f} %"


def _reading(value: float, unit: str) -> tuple[float, str]:
    """A factor and a prefix for units of one letter; others stay as they are."""
    if unit not in {"m", "s"}:
        return 1.0, unit
    for factor, prefix in PREFIXES:
        if abs(value) >= factor:
            return factor, prefix + unit
    return 1.0, unit


def _no_number(_constant: str) -> Any:
    """NaN and infinities of Python's JSON: nothing is known."""
