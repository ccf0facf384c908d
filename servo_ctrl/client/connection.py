"""A connection to the running controller of a machine on its bus."""

import asyncio
import contextlib
from collections.abc import AsyncIterator

from servo_ctrl.canopen.errors import SdoError
from servo_ctrl.canopen.node import load_own_eds
from servo_ctrl.canopen.remote_controller import RemoteController
from servo_ctrl.canopen.stack import Network
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.io.can_port import BusError, open_port

SDO_RESPONSE = 0x580
"""COB-ID of a server's SDO response without its node-ID (CiA 301, pre-defined connection set)."""


@contextlib.asynccontextmanager
async def connected(config: MachineConfig, bus: str) -> AsyncIterator[RemoteController]:
    """Yield the controller on its bus. Raises BusError, and SdoError that names the node and the bus."""
    eds, node_id = load_own_eds(config), config.controller.node_id
    down: list[BusError] = []
    # only its SDO responses: the cycle sends a thousand and more other frames a second
    port = open_port(bus, only=(SDO_RESPONSE + node_id,))
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
