"""verdict.json of `reconcile`: checked, for another program wrote it, and turned into texts."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from kernels.readable_units import display_unit
from servo_ctrl.config.file_format import format_problem
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.json_file import read_json_file

MAX_CHARACTERS = 10_000_000
"""Bounds verdict.json; chosen: a verdict of three axes has about ten thousand characters."""

Text = Annotated[str, StringConstraints(max_length=4000)]
Quantity = float | None
"""None: NaN in the file, where nothing could be determined."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]

SENTENCES = {
    "effects": (
        word("The model leaves out physics of the catalogue."),
        word("Read the findings, then accept the model."),
    ),
    "parameters": (
        word("The model has the right effects, but its parameters are off."),
        word("Accept the model."),
    ),
    "consistent": (
        word("Model and recordings agree: the residual is noise."),
        word("Nothing is to be done."),
    ),
    "unknown": (
        word("The residual has a systematic part that no effect of the catalogue explains."),
        word("The report shows where it occurs."),
    ),
}
"""By verdict: what it means, and what to do."""
CHANNEL_NAMES = {"force": word("motor force"), "deviation": word("scale less motor")}
NAMES = {"stribeck": "Stribeck", "coulomb": "Coulomb", "lugre": "LuGre", "gms": "GMS"}
"""Words in the names of effects that are names of people and models."""
UNIT_ENDINGS = ("_n_s2_m2", "_n_s_m", "_m_s", "_n_m", "_m_n", "_rad", "_hz", "_n", "_m", "_s")


class VerdictError(ServoCtrlError):
    """A verdict.json cannot be used."""


class _VerdictPart(BaseModel):
    # keys that the page does not show are ignored, so that later versions of reconcile may add to them
    model_config = ConfigDict(frozen=True, extra="ignore")


class ParameterValue(_VerdictPart):
    """A parameter of an effect with its 95 % interval, SI."""

    value: Quantity
    ci95: tuple[Quantity, Quantity]
    unit: Text


class RivalEffect(_VerdictPart):
    """An effect that was tried in place of a finding."""

    effect: Text
    why_not: Text


class Finding(_VerdictPart):
    """An effect that the model leaves out."""

    axis: Text
    effect: Text
    confidence: Share | None
    equivalent: list[Text] = []
    parameters: dict[Text, ParameterValue] = {}
    explanation: Text
    runners_up: list[RivalEffect] = []


class ResidualRms(_VerdictPart):
    """RMS of the residual on the held-out blocks."""

    heldout: Quantity


class ChannelFit(_VerdictPart):
    """RMS of one residual channel: nominal model, refitted model, model with the effects."""

    unit: Literal["N", "m"]
    before: ResidualRms
    refitted: ResidualRms
    after: ResidualRms


class AxisFit(_VerdictPart):
    """The residual channels of one axis."""

    force: ChannelFit | None = None
    deviation: ChannelFit | None = None


class DiagnosisVerdict(_VerdictPart):
    """The part of a verdict that the page shows."""

    verdict: Literal["effects", "parameters", "consistent", "unknown"]
    notes: Annotated[list[Text], Field(max_length=1000)] = []
    findings: Annotated[list[Finding], Field(max_length=1000)]
    fit: dict[Text, AxisFit]


class Improvement(NamedTuple):
    """RMS of one residual channel on the held-out blocks, in `unit`; NaN where it is not known."""

    axis: str
    channel: str
    unit: str
    levels: tuple[float, float, float]
    """Of the nominal model, the refitted one, and the one with the effects."""


def read_verdict(path: Path) -> DiagnosisVerdict:
    """Read the verdict of a diagnosis. Raises VerdictError naming file and key."""

    def parsed(text: str) -> Any:
        content = json.loads(text, parse_constant=_unknown_value)
        if isinstance(content, dict) and (problem := format_problem(content.get("format"))):
            raise VerdictError(f"{path}: {problem}")
        return content

    return read_json_file(DiagnosisVerdict, path, MAX_CHARACTERS, VerdictError, parsed)


def improvements(verdict: DiagnosisVerdict) -> Iterator[Improvement]:
    """Yield the RMS of each axis and residual channel, in a unit of readable size."""
    for axis, fit in verdict.fit.items():
        for key, name in CHANNEL_NAMES.items():
            channel: ChannelFit | None = getattr(fit, key)
            if channel is None:
                continue
            rms = (channel.before.heldout, channel.refitted.heldout, channel.after.heldout)
            before, refitted, after = (math.nan if level is None else level for level in rms)
            factor, unit = display_unit(channel.unit, before)
            yield Improvement(axis, tr(name), unit, (before / factor, refitted / factor, after / factor))


def parameter_text(parameter: ParameterValue) -> str:
    """Return value and interval, as `3.02 µm (2.95 to 3.1)`."""
    if parameter.value is None:
        return "-"
    factor, unit = display_unit(parameter.unit, parameter.value)
    text = f"{parameter.value / factor:.3g} {unit}".rstrip()
    low, high = parameter.ci95
    if low is None or high is None or low == high:
        return text
    between = {"low": f"{low / factor:.3g}", "high": f"{high / factor:.3g}"}
    return tr("{value} ({low} to {high})", value=text, **between)


def effect_name(name: str) -> str:
    """Return the name of an effect in words, as `drive compliance`."""
    return " ".join(NAMES.get(part, part) for part in name.split("_"))


def parameter_name(key: str) -> str:
    """Return the name of a parameter without its unit, which the value has: `viscous_n_s_m` is viscous."""
    stems = (key.removesuffix(ending) for ending in UNIT_ENDINGS if key.endswith(ending))
    return effect_name(next(stems, "") or key)


def percent(share: float | None) -> str:
    """Return a share in per cent, never rounded to certainty."""
    if share is None:
        return "-"
    if share >= 0.995:
        return "> 99 %"
    return "< 1 %" if share < 0.005 else f"{100.0 * share:.0f} %"


def _unknown_value(_constant: str) -> Any:
    """Replace NaN and infinities of Python's JSON by None."""
