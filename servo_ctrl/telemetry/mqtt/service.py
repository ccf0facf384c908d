"""The MQTT link: publishes status, reversals and rows, and executes the commands of other clients.

The machine never waits for the broker: `reversal`, `due` and `changed` only queue what to publish. One task
reads and the others publish, all in one TaskGroup; when one fails, the link connects again. It then sends
unconfirmed answers first and publishes all retained topics again.
"""

import asyncio
import contextlib
import logging
import random
import time
from collections import deque
from collections.abc import Callable
from datetime import UTC, datetime

from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.telemetry.mqtt.client import Broker, BrokerError, Connection, Incoming, Will
from servo_ctrl.telemetry.mqtt.commands import MqttCommands
from servo_ctrl.telemetry.mqtt.payloads import (
    OFFLINE,
    ONLINE,
    ack_payload,
    due_payload,
    learned_payload,
    reversal_payload,
    state_payload,
)
from servo_ctrl.telemetry.mqtt.stream import RowStream
from servo_ctrl.telemetry.mqtt.topics import Topics, level

REVERSALS_WAITING_MAX = 256
"""Bounds the newest reversals kept without a broker; dropped ones are counted. Chosen."""
ANSWERS_WAITING_MAX = 1000
"""Bounds the waiting answers, beyond which no command is read; chosen."""
STATE_INTERVAL_S = 0.2
"""Shortest period of the state topic; chosen."""
STATE_REFRESH_S = 5.0
"""Longest period of the state topic, because cycles and remaining time change without an event."""
FIRST_RETRY_S, LONGEST_RETRY_S = 0.25, 30.0
"""Bounds of the exponential back-off between attempts to connect; chosen."""
STEADY_S = 10.0
"""A connection that lasted this long resets the back-off; chosen."""
CLOSING_LIMIT_S = 1.0
"""Bounds the time for the last messages at the end of a run; chosen."""

_LOG = logging.getLogger(__name__)


class MqttLink:
    """Raises ConfigError when a password or certificate cannot be read; `run` goes into a TaskGroup.

    All calls are made in the thread of the loop; `note` logs each command as an event. `problem` says why
    there is no connection, "" while connected.
    """

    def __init__(
        self,
        config: MqttConfig,
        machine_name: str,
        handler: CommandHandler,
        stream: RowStream | None = None,
        note: Callable[[str], None] | None = None,
    ) -> None:
        self.problem = "not connected yet"
        self.reversals_dropped = 0
        self._topics = Topics(config.prefix, machine_name)
        will = Will(self._topics.online, OFFLINE)
        self._broker = Broker(config, f"servo_ctrl-{level(machine_name)}", will)
        self._handler = handler
        self._stream = stream
        topics = self._topics.command_of
        self._commands = {topics[right]: MqttCommands(handler, right, note) for right in topics}
        if config.plain_command:
            self._commands[self._topics.command] = MqttCommands(handler, None, note)
        self._answers: asyncio.Queue[bytes] = asyncio.Queue(ANSWERS_WAITING_MAX)
        self._unconfirmed: bytes | None = None
        self._reversals: deque[tuple[str, ReversalReport, datetime]] = deque(maxlen=REVERSALS_WAITING_MAX)
        self._reversal_noted = asyncio.Event()
        self._due: dict[str, bool] = {}
        self._changed = asyncio.Event()

    def reversal(self, axis: str, report: ReversalReport) -> None:
        """Queue an evaluated reversal of an axis for publication."""
        self.reversals_dropped += len(self._reversals) == REVERSALS_WAITING_MAX
        self._reversals.append((axis, report, datetime.now(UTC)))
        self._reversal_noted.set()

    def due(self, axis: str, due: bool) -> None:
        """Queue for publication whether learning is due for an axis."""
        self._due[axis] = due
        self._changed.set()

    def changed(self) -> None:
        """Queue the changed status for publication."""
        self._changed.set()

    async def run(self) -> None:
        """Stay connected, with new attempts after each loss, until cancelled."""
        task, retry_s = asyncio.current_task(), FIRST_RETRY_S
        while True:
            began_s = time.monotonic()
            self._log(await asyncio.create_task(self._until_lost()))
            if task is not None and task.cancelling():
                raise asyncio.CancelledError  # a TaskGroup that fails while cancelled raises only the failure
            if time.monotonic() - began_s > STEADY_S:
                retry_s = FIRST_RETRY_S
            await asyncio.sleep(retry_s * random.uniform(0.5, 1.0))  # noqa: S311  # spreads clients, no secret
            retry_s = min(2.0 * retry_s, LONGEST_RETRY_S)

    async def _until_lost(self) -> str:
        """Connect and stay connected; return why the connection ended."""
        problem = ""
        try:
            await self._connected()
        except* BrokerError as lost:
            problem = str(lost.exceptions[0])
        except* Exception as bugs:  # noqa: BLE001  # a bug must not stop the machine, only the connection
            problem = repr(bugs.exceptions[0])
            _LOG.exception("MQTT: internal error")
        return problem

    async def _connected(self) -> None:
        async with self._broker.connection() as connection:
            for topic in self._commands:
                if refused := await connection.subscribe(topic):
                    _LOG.warning("MQTT %s: %s cannot be received: %s", self._broker.address, topic, refused)
            try:
                await connection.publish(self._topics.online, ONLINE, retain=True)
                self._log("")
                async with asyncio.TaskGroup() as group:
                    group.create_task(self._read_commands(connection))
                    group.create_task(self._send_answers(connection))
                    group.create_task(self._send_retained(connection))
                    group.create_task(self._send_reversals(connection))
                    if self._stream is not None:
                        group.create_task(self._send_stream(connection, self._stream))
            except asyncio.CancelledError:
                await self._send_last(connection)
                raise
            except BaseExceptionGroup:
                async for message in connection.left_over():
                    self._execute(message)
                raise

    def _log(self, problem: str) -> None:
        """Log a change of the connection."""
        if problem == self.problem:
            return
        self.problem = problem
        if problem:
            _LOG.warning("MQTT %s: not connected, trying again: %s", self._broker.address, problem)
        else:
            _LOG.info("MQTT %s: connected", self._broker.address)

    async def _read_commands(self, connection: Connection) -> None:
        async for message in connection.messages():
            self._execute(message)
            if self._answers.full():
                await self._answers.join()

    def _execute(self, message: Incoming) -> None:
        """Execute a command and queue its answer."""
        if message.retained and not message.payload:
            return  # a client deletes a retained command
        commands = self._commands.get(message.topic)
        if commands is None:
            return  # a topic without subscription
        if self._answers.full():
            _LOG.warning("MQTT %s: a command was neither read nor answered: too many", self._broker.address)
            return
        answer = commands.answer(message.payload, retained=message.retained)
        self._answers.put_nowait(ack_payload(self._handler.status().cycles, *answer))

    async def _send_answers(self, connection: Connection) -> None:
        while True:
            if self._unconfirmed is None:
                self._unconfirmed = await self._answers.get()
            await connection.publish(self._topics.ack, self._unconfirmed)
            self._unconfirmed = None
            self._answers.task_done()

    async def _send_retained(self, connection: Connection) -> None:
        """Publish state, due and learned functions: all of them first, then the changed ones."""
        topics, published = self._topics, dict[str, object]()
        self._due = {axis.name: axis.learning_due for axis in self._handler.status().axes}
        while True:
            self._changed.clear()
            status = self._handler.status()
            while self._due:
                axis_name, due = self._due.popitem()
                payload = due_payload(status.cycles, due=due)
                await connection.publish(topics.learning_due(axis_name), payload, retain=True)
            for axis in status.axes:
                functions = (axis.version, axis.learned)
                if published.get(axis.name) != functions:
                    payload = learned_payload(status.cycles, axis)
                    await connection.publish(topics.learned(axis.name), payload, retain=True)
                    published[axis.name] = functions
            await connection.publish(topics.state, state_payload(status, self.reversals_dropped), retain=True)
            await asyncio.sleep(STATE_INTERVAL_S)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(STATE_REFRESH_S):
                    await self._changed.wait()

    async def _send_reversals(self, connection: Connection) -> None:
        while True:
            await self._reversal_noted.wait()
            self._reversal_noted.clear()
            while self._reversals:
                axis, report, noted = self._reversals.popleft()
                topic = self._topics.reversal(axis)
                await connection.publish(topic, reversal_payload(report, noted), qos=0)

    async def _send_stream(self, connection: Connection, stream: RowStream) -> None:
        """Publish the rows as fast as the broker accepts them, without rows older than the connection."""
        stream.discard()
        await connection.publish(self._topics.stream_channels, stream.description(), retain=True)
        while True:
            await connection.publish(self._topics.stream, await stream.next_message(), qos=0)

    async def _send_last(self, connection: Connection) -> None:
        """Publish remaining answers, last rows and "offline"; the will covers only a lost connection."""
        with contextlib.suppress(BrokerError, TimeoutError):
            async with asyncio.timeout(CLOSING_LIMIT_S):
                while self._unconfirmed is not None or not self._answers.empty():
                    payload = self._unconfirmed or self._answers.get_nowait()
                    self._unconfirmed = None
                    await connection.publish(self._topics.ack, payload)
                if self._stream is not None and (rest := self._stream.rest()):
                    await connection.publish(self._topics.stream, rest, qos=0)
                await connection.publish(self._topics.online, OFFLINE, retain=True)
