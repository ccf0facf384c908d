"""One request of `servo-ctrl ask`, sent to the controller by SDO, and its answer printed."""

import asyncio
import contextlib
from collections.abc import AsyncIterator

import typer
from rich.console import Console

from servo_ctrl.canopen.errors import SdoError
from servo_ctrl.canopen.node import own_dictionary
from servo_ctrl.canopen.remote_controller import RemoteController
from servo_ctrl.canopen.stack import Network
from servo_ctrl.cli.ask_request import RefusedError, SettingChange
from servo_ctrl.cli.status_report import as_json, learning_line, print_status
from servo_ctrl.commands.command import CommandRequest
from servo_ctrl.commands.learning_status import ACTIVE, LearningState, LearningStatus
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.io.can_port import BusError, open_port

WATCH_S = 0.5
"""Period of the status reads of `watch`: a person reads no faster."""
SDO_ANSWER = 0x580
"""CiA 301, pre-defined connection set: COB-ID of a server's SDO answer, less its node-ID."""


async def perform(
    request: CommandRequest | SettingChange | str, config: MachineConfig, bus: str, *, json: bool
) -> None:
    """Send the request and print the answer. Raises RefusedError with the controller's reason."""
    async with _controller(config, bus) as remote:
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
    """Print a line whenever it differs from the last one, until learning ends."""
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


@contextlib.asynccontextmanager
async def _controller(config: MachineConfig, bus: str) -> AsyncIterator[RemoteController]:
    """The controller on its bus. Raises BusError, and SdoError that names the node and the bus."""
    eds, node_id = own_dictionary(config), config.controller.node_id
    down: list[BusError] = []
    # Only its SDO answers: the cycle sends a thousand and more other frames a second.
    port = open_port(bus, only=(SDO_ANSWER + node_id,))
    try:
        port.attach(asyncio.get_running_loop())
        port.on_down = down.append
        network = Network(port.send)
        port.fallback = network.notify
        remote = RemoteController(network, node_id, eds, tuple(config.axes))
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
