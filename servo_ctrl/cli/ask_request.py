"""One request of `servo-ctrl ask`: parse its words, send it to the controller by SDO, print the answer."""

import asyncio
import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import typer
from rich.console import Console
from rich.table import Table

from servo_ctrl.canopen.remote_controller import RemoteController
from servo_ctrl.client.connection import connected
from servo_ctrl.commands.command import COMMAND_WORDS, CommandRequest
from servo_ctrl.commands.learning_status import ACTIVE, LearningState, LearningStatus
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import SETTINGS, Setting
from servo_ctrl.commands.status_fields import axis_rows
from servo_ctrl.commands.texts import on_off
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.telemetry.mqtt.payloads import functions_document, state_document, to_document
from servo_ctrl.units import MM, UM

SETTING_OF = {setting.word: setting for setting in SETTINGS.values()}
"""Settings by their names on the command line."""
WATCH_S = 0.5
"""Period of the status reads of `watch`; chosen: a person reads no faster."""


class RefusedError(ServoCtrlError):
    """The words are not a request, the controller refused it, or the learning that is watched has failed."""


class SettingChange(NamedTuple):
    """A field of `Settings` and its new value, SI."""

    setting: str
    value: float | str | bool


def parse_request(
    words: Sequence[str], axis: str, axes: Sequence[str]
) -> CommandRequest | SettingChange | str:
    """Parse a request; "status" and "watch" are returned as they are. Raises RefusedError with the reason."""
    if axis and axis not in axes:
        raise RefusedError(f'--axis: there is no axis "{axis}"; the machine has {", ".join(axes)}')
    match list(words):
        case [name] if name in COMMAND_WORDS:
            return CommandRequest(COMMAND_WORDS[name], axis)
        case ["set", *_] if axis:
            raise RefusedError("set: settings are the machine's, not an axis': leave --axis out")
        case ["set", name, value] if name in SETTING_OF:
            return SettingChange(SETTING_OF[name].name, _setting_value(SETTING_OF[name], value))
        case ["set", *_]:
            raise RefusedError(f"set: takes one of {', '.join(SETTING_OF)} and a value")
        case ["status" | "watch" as word]:
            return word
    known = ", ".join([*COMMAND_WORDS, "set", "status", "watch"])
    raise RefusedError(f'"{" ".join(words)}" is not a command; known are {known}')


def _setting_value(setting: Setting, text: str) -> float | str | bool:
    """Parse the value of a setting, SI. Raises RefusedError."""
    if setting.entry.names:
        if text not in setting.entry.names:
            raise RefusedError(f'{setting.word}: "{text}" is none of {", ".join(setting.entry.names)}')
        return text
    if setting.kind is bool:
        if text not in {"on", "off"}:
            raise RefusedError(f'{setting.word}: "{text}" is neither on nor off')
        return text == "on"
    try:
        value = float(text) / setting.factor
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RefusedError(f'{setting.word}: "{text}" is not a number')
    return value


async def perform(
    request: CommandRequest | SettingChange | str, config: MachineConfig, bus: str, *, json: bool
) -> None:
    """Send the request and print the answer. Raises RefusedError with the controller's reason."""
    async with connected(config, bus) as remote:
        match request:
            case CommandRequest():
                result = await asyncio.to_thread(remote.execute, request)
            case SettingChange(setting, value):
                result = await asyncio.to_thread(remote.change, setting, value)
            case "watch":
                await _watch(remote)
                return
            case _:
                status = await asyncio.to_thread(remote.status)
                if json:
                    typer.echo(as_json(status))
                else:
                    print_status(status, Console())
                return
        if not result.accepted:
            raise RefusedError(f"refused: {result.reason}")


async def _watch(remote: RemoteController) -> None:
    """Print the progress of learning whenever it changes, until it ends."""
    printed = ""
    while True:
        learning: LearningStatus = await asyncio.to_thread(remote.learning)
        line = learning_line(learning)
        if learning.state in {LearningState.ABORTED, LearningState.FAILED}:
            raise RefusedError(f"learning {line}")
        if line != printed:
            typer.echo(line)
            printed = line
        if learning.state not in ACTIVE:
            return
        await asyncio.sleep(WATCH_S)


def print_status(status: MachineStatus, console: Console) -> None:
    """Print the status as lines and a table with a column for each axis."""
    required_m, learner, adaptation, feed, rapid, *_others = status.settings
    lines = (
        *([f"stopped: {status.reason}"] if status.reason else []),
        f"{status.stage.words}, {status.cycles} cycles, {status.missed_ticks} missed ticks",
        f"learning: {learning_line(status.learning)}",
        f"J required {required_m / UM:g} um, learner {learner}, adaptation {on_off(adaptation)}",
        f"override: feed {feed:g} %, rapid {rapid:g} %, single block {on_off(status.settings.single_block)}",
    )
    for line in lines:
        console.print(line, highlight=False)
    table = Table("axis", *(axis.name for axis in status.axes))
    for label, cells in axis_rows(status.axes):
        table.add_row(label, *cells)
    console.print(table)


def as_json(status: MachineStatus) -> str:
    """Format the retained MQTT state as JSON, with the last reversal and the functions of each axis."""
    document: dict[str, Any] = state_document(status)
    for axis in status.axes:
        # the cycle says when the reversal was
        last = None if axis.last is None else {"cycle": axis.last.cycle, **to_document(axis.last)}
        document["axis"][axis.name] |= {"functions": functions_document(axis), "last_reversal": last}
    return json.dumps(document, indent=2)


def learning_line(learning: LearningStatus) -> str:
    """Return state and progress of a learning run, in one line."""
    state = learning.state.name.lower()
    if not learning.planned or learning.state is LearningState.IDLE:
        return ": ".join(text for text in (state, learning.reason) if text)
    line = f"{state}, axis {learning.axis}, {learning.strokes_done} of {learning.strokes_total} strokes"
    if learning.state in ACTIVE:
        best = f"best J {learning.best_m / UM:.2f} um, " if learning.best_m >= 0.0 else ""
        at_m_s2 = learning.acceleration_m_s2
        at = "" if math.isnan(at_m_s2) else f", {at_m_s2 / MM:g} mm/s2"
        line += f" ({learning.stage}{at}), {best}{learning.remaining_s:.0f} s of machine time to go"
    return f"{line}: {learning.reason}" if learning.reason not in {"", state} else line
