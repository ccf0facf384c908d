"""`servo-ctrl ask`: commands to a running controller, and its status, by SDO over the bus."""

from __future__ import annotations

import asyncio
import contextlib
import math
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer
from rich.console import Console

from servo_ctrl.canopen.errors import SdoError
from servo_ctrl.canopen.node import own_dictionary
from servo_ctrl.canopen.remote_desk import RemoteDesk
from servo_ctrl.canopen.stack import Network
from servo_ctrl.cli.options import BusOption, MachineOption  # noqa: TC001  # typer reads them at run time
from servo_ctrl.cli.status_report import as_json, learning_line, print_status
from servo_ctrl.config.desk import LEARNERS, Command, LearningState, Request, Setting
from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.load import load_machine
from servo_ctrl.io.can_port import open_port

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Sequence

    from servo_ctrl.config.desk import LearningStatus
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.io.can_port import BusError

COMMANDS = {
    "start-learning": Command.START_LEARNING,
    "abort-learning": Command.ABORT_LEARNING,
    "pause-learning": Command.PAUSE_LEARNING,
    "resume-learning": Command.RESUME_LEARNING,
    "enable": Command.ENABLE_COMPENSATION,
    "disable": Command.DISABLE_COMPENSATION,
    "enable-observer": Command.ENABLE_OBSERVER,
    "disable-observer": Command.DISABLE_OBSERVER,
    "roll-back": Command.ROLL_BACK,
    "start-program": Command.START_PROGRAM,
    "enable-screw": Command.ENABLE_SCREW,
    "disable-screw": Command.DISABLE_SCREW,
    "roll-back-screw": Command.ROLL_BACK_SCREW,
    "switch-on": Command.ENABLE,
    "switch-off": Command.DISABLE,
    "quick-stop": Command.QUICK_STOP,
    "hold-program": Command.HOLD_PROGRAM,
    "resume-program": Command.RESUME_PROGRAM,
    "abort-program": Command.ABORT_PROGRAM,
    "home": Command.HOME,
}
SETTINGS = {
    "required-um": Setting.REQUIRED_M,
    "learner": Setting.LEARNER,
    "adaptation": Setting.ADAPTATION,
}
WATCH_S = 0.5
GOING_ON = {LearningState.RUNNING, LearningState.PAUSING, LearningState.PAUSED}


class RefusedError(ServoCtrlError):
    """The controller, or we before it was asked, said no; or what was waited for came to nothing."""


class Change(NamedTuple):
    """A setting and its value, SI."""

    setting: Setting
    value: float


def ask(
    machine: MachineOption,
    bus: BusOption,
    words: Annotated[list[str], typer.Argument(metavar="COMMAND", help="See above.", show_default=False)],
    axis: Annotated[str, typer.Option(help="Axis the command is for. Without it: all.")] = "",
    json: Annotated[bool, typer.Option("--json", help="Print the status as JSON.")] = False,
) -> None:
    """Give a running controller a command, or read its status, over the bus.

    COMMAND is one of start-learning, abort-learning, pause-learning, resume-learning, enable, disable (the
    friction compensation), enable-observer, disable-observer, enable-screw, disable-screw, roll-back (the
    friction pulse), roll-back-screw, start-program, hold-program, resume-program, abort-program, switch-on,
    switch-off (the drives), quick-stop, home; set required-um NUMBER, set learner fast|paper|screw,
    set adaptation on|off; status; watch (until learning ends). Exits with 0 when the controller accepted, 1
    when not. docs/commands.md has the objects behind it.

    Example: `servo-ctrl ask --machine machines/xy_table --bus socketcan:vcan0 start-learning --axis x`
    """
    config = load_machine(machine)
    question = understood(words, axis, config)
    asyncio.run(_put(question, config, bus, json=json))


def understood(words: Sequence[str], axis: str, config: MachineConfig) -> Request | Change | str:
    """What the words ask for; "status" and "watch" stay words. Raises RefusedError naming what is wrong."""
    if axis and axis not in config.axes:
        raise RefusedError(f'--axis: there is no axis "{axis}"; the machine has {", ".join(config.axes)}')
    match list(words):
        case [name] if name in COMMANDS:
            return Request(COMMANDS[name], axis)
        case ["set", *_] if axis:
            raise RefusedError("set: settings are the machine's, not an axis': leave --axis out")
        case ["set", name, value] if name in SETTINGS:
            return Change(SETTINGS[name], _setting_value(name, value))
        case ["set", *_]:
            raise RefusedError(f"set: takes one of {', '.join(SETTINGS)} and a value")
        case ["status" | "watch" as word]:
            return word
    known = ", ".join([*COMMANDS, "set", "status", "watch"])
    raise RefusedError(f'"{" ".join(words)}" is no command; known are {known}')


def _setting_value(name: str, text: str) -> float:
    if name == "learner":
        if text not in LEARNERS:
            raise RefusedError(f'learner: "{text}" is none of {", ".join(LEARNERS)}')
        return float(LEARNERS.index(text))
    if name == "adaptation":
        if text not in {"on", "off"}:
            raise RefusedError(f'adaptation: "{text}" is neither on nor off')
        return float(text == "on")
    try:
        required_m = float(text) / 1e6
    except ValueError:
        required_m = math.nan
    if not math.isfinite(required_m):
        raise RefusedError(f'required-um: "{text}" is not a number')
    return required_m


async def _put(question: Request | Change | str, config: MachineConfig, bus: str, *, json: bool) -> None:
    """Ask, and print the answer. Raises RefusedError with the controller's reason."""
    async with _controller(config, bus) as remote:
        match question:
            case Request():
                verdict = await asyncio.to_thread(remote.execute, question)
            case Change(setting, value):
                verdict = await asyncio.to_thread(remote.change, setting, value)
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
        if not verdict.accepted:
            raise RefusedError(f"refused: {verdict.reason}")


async def _watch(remote: RemoteDesk) -> None:
    """A line whenever something changed, until learning ends."""
    said = ""
    while True:
        learning: LearningStatus = await asyncio.to_thread(remote.learning)
        line = learning_line(learning)
        if learning.state in {LearningState.ABORTED, LearningState.FAILED}:
            raise RefusedError(f"learning {line}")
        if line != said:
            typer.echo(line)
            said = line
        if learning.state not in GOING_ON:
            return
        await asyncio.sleep(WATCH_S)


@contextlib.asynccontextmanager
async def _controller(config: MachineConfig, bus: str) -> AsyncIterator[RemoteDesk]:
    """The controller on its bus. Raises BusError, or SdoError that says which controller is meant."""
    eds, node_id = own_dictionary(config), config.controller.node_id
    down: list[BusError] = []
    port = open_port(bus, only=(0x580 + node_id,))  # a cycle is a thousand frames a second and more
    try:
        port.attach(asyncio.get_running_loop())
        port.on_down = down.append
        network = Network(port.send)
        port.fallback = network.notify
        remote = RemoteDesk(network, node_id, eds, tuple(config.axes))
        try:
            await asyncio.to_thread(remote.identify)
            yield remote
        except SdoError as error:
            if down:
                raise down[0] from None
            hint = "" if error.abort_code else "; is it running?"
            raise SdoError(f"controller (node {node_id}) on {bus}: {error}{hint}") from None
        finally:
            remote.close()
    finally:
        port.close()
