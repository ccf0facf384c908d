"""An MQTT link under test, and its broker."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable

from fake_command_handler import FakeCommandHandler
from mosquitto import LIMIT_S, Mosquitto

from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.telemetry.mqtt.service import MqttLink

ROOT = "servo_ctrl/xy_table"
ALL = f"{ROOT}/#"
COMMAND = f"{ROOT}/command"


def link_to(broker: Mosquitto, handler: FakeCommandHandler, **keys: object) -> MqttLink:
    """Return a link of a machine with axes x and y; `keys` of the section [mqtt]."""
    config = MqttConfig.model_validate({"port": broker.port, **keys})
    return MqttLink(config, "xy_table", handler)


@contextlib.asynccontextmanager
async def running(link: MqttLink) -> AsyncIterator[None]:
    """Run the link; assert that it does not end by itself, and ends within LIMIT_S when cancelled."""
    task = asyncio.create_task(link.run())
    try:
        yield
        assert not task.done()
    finally:
        task.cancel()
        _, left = await asyncio.wait((task,), timeout=LIMIT_S)
        assert not left, "the link does not end"


async def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition on the link. Raises TimeoutError after LIMIT_S."""
    async with asyncio.timeout(LIMIT_S):
        while not condition():  # noqa: ASYNC110  # the link has no event for it
            await asyncio.sleep(0.01)
