"""A connection to an MQTT broker: the one file that knows aiomqtt (and paho-mqtt below it).

MQTT 5, always with a clean start: commands sent while nobody listened are not delivered later. Reading and
writing happen in the asyncio loop on a non-blocking socket; only name look-up, TCP connect and TLS handshake
run in a thread, aiomqtt's own way. Every wait has a bound.
"""

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator, Iterator
from typing import Any, NamedTuple, cast

import aiomqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode
from paho.mqtt.subscribeoptions import SubscribeOptions

from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.telemetry.mqtt.credentials import password_in, tls_context

ANSWER_LIMIT_S = 5.0
"""For the broker to answer CONNECT, SUBSCRIBE and PUBLISH; paho has the same for TCP and TLS."""
CLOSING_LIMIT_S = 1.0
"""Bounds the end of a connection, seconds; chosen."""
WAITING_MESSAGES = 1000
"""Received messages that may wait for us, chosen; more are lost."""
PACKET_LIMIT = 65536
"""Bytes of a packet; the broker keeps larger ones to itself."""
UNSPECIFIED_ERROR = 0x80
"""Reason code of MQTT 5; paho puts it where it has no other."""

_LOG = logging.getLogger(__name__)
# Both libraries speak of every lost connection, at every attempt; the link says it once, in our words.
_SILENT = logging.getLogger(f"{__name__}.library")
_SILENT.addHandler(logging.NullHandler())
_SILENT.propagate = False


class BrokerError(Exception):
    """There is no connection to the broker, or no more; the text says why."""


class Incoming(NamedTuple):
    """A message from the broker."""

    topic: str
    payload: bytes
    retained: bool
    """Sent to be kept by the broker, or kept by it."""


class Will(NamedTuple):
    """A retained message that the broker publishes for us when our connection is lost."""

    topic: str
    payload: bytes


class Broker:
    """How to reach the broker. Raises ConfigError when a password or certificate cannot be read."""

    def __init__(self, config: MqttConfig, client_id: str, will: Will | None = None) -> None:
        self._config, self._client_id = config, config.client_id or client_id
        self._will = None if will is None else aiomqtt.Will(will.topic, will.payload, qos=1, retain=True)
        self._password = None if config.password_file is None else password_in(config.password_file)
        self._tls = tls_context(config) if config.tls else None
        self._properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]  # paho's
        self._properties.MaximumPacketSize = PACKET_LIMIT

    @property
    def address(self) -> str:
        """For people: host and port."""
        return f"{self._config.host}:{self._config.port}"

    @contextlib.asynccontextmanager
    async def connection(self) -> AsyncIterator["Connection"]:
        """Connected inside; raises BrokerError when that fails or ends."""
        client = _RefusalReporter(
            self._config.host,
            self._config.port,
            identifier=self._client_id,
            username=self._config.username,
            password=self._password,
            tls_context=self._tls,
            protocol=aiomqtt.ProtocolVersion.V5,
            clean_start=True,
            properties=self._properties,
            keepalive=self._config.keepalive_s,
            will=self._will,
            timeout=ANSWER_LIMIT_S,
            max_queued_incoming_messages=WAITING_MESSAGES,
            logger=_SILENT,
        )
        try:
            try:
                with _as_broker_error():
                    await _enter(client)
            except BrokerError as error:
                # TLS 1.3 ends the handshake before the broker has looked at our certificate
                silent = self._tls is not None and "timed out" in str(error)
                hint = ": it is away, or refuses our certificate" if silent else ""
                raise BrokerError(f"{error}{hint}") from None
            yield Connection(client)
        finally:
            await _leave(client)


class _RefusalReporter(aiomqtt.Client):
    """Logs that the broker refuses a message, once a connection; aiomqtt takes it for sent."""

    _refused = False

    def _on_publish(  # the callback of paho; aiomqtt ignores the reason code
        self, client: Any, userdata: Any, mid: int, reason_code: ReasonCode, properties: Properties
    ) -> None:
        if reason_code.is_failure and not self._refused:
            self._refused = True
            _LOG.warning("MQTT: the broker refuses messages of %s: %s", self.identifier, reason_code)
        super()._on_publish(client, userdata, mid, reason_code, properties)


class Connection:
    """What can be done while connected."""

    def __init__(self, client: aiomqtt.Client) -> None:
        self._client = client

    async def publish(self, topic: str, payload: bytes, *, qos: int = 1, retain: bool = False) -> None:
        """Send a message; with qos 1 the broker has it when this returns."""
        with _as_broker_error(), _cancellable():
            await self._client.publish(topic, payload, qos, retain)

    async def subscribe(self, topic: str) -> str:
        """Ask for the messages of a topic with qos 1; "" or why the broker refuses."""
        # with it a retained message is recognisable, even when it arrives as it is published
        options = SubscribeOptions(qos=1, retainAsPublished=True)
        with _as_broker_error(), _cancellable():
            (code,) = await self._client.subscribe(topic, options=options)
        return "" if isinstance(code, int) or not code.is_failure else str(code)

    async def messages(self) -> AsyncIterator[Incoming]:
        """What arrives on the topics asked for."""
        with _as_broker_error():
            async for message in self._client.messages:
                yield Incoming(message.topic.value, bytes(message.payload), message.retain)

    async def left_over(self) -> AsyncIterator[Incoming]:
        """Messages that were confirmed to the broker, but not yet read when the connection ended."""
        messages = self._client.messages
        while len(messages):
            message = await anext(messages)
            yield Incoming(message.topic.value, bytes(message.payload), message.retain)


async def _enter(client: aiomqtt.Client) -> None:
    """Connect. The thread in which that happens cannot be cancelled: what it still opens is closed here."""
    entering = asyncio.create_task(client.__aenter__())
    try:
        await asyncio.shield(entering)
    except asyncio.CancelledError:
        await asyncio.wait((entering,), timeout=CLOSING_LIMIT_S)
        entering.cancel()
        await asyncio.gather(entering, return_exceptions=True)
        raise
    finally:
        del entering  # a failure would hold itself, and its socket, until the garbage collector comes


async def _leave(client: aiomqtt.Client) -> None:
    """Disconnect in order where that is possible, and close the socket in any case."""
    with contextlib.suppress(aiomqtt.MqttError, TimeoutError):
        async with asyncio.timeout(CLOSING_LIMIT_S):
            await client.__aexit__(None, None, None)
    # After an attempt or an end that timed out, aiomqtt keeps the socket, its reader and a task. Paho
    # drops all three when the stream ends, and there is no public access to the stream.
    paho = client._client  # noqa: SLF001
    open_socket = cast("socket.socket | None", paho.socket())
    if open_socket is None:
        return
    with contextlib.suppress(OSError):
        open_socket.shutdown(socket.SHUT_RDWR)
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(CLOSING_LIMIT_S):
            while paho.socket() is not None:  # noqa: ASYNC110  # paho tells it to aiomqtt alone
                await asyncio.sleep(0.01)


@contextlib.contextmanager
def _as_broker_error() -> Iterator[None]:
    try:
        yield
    except aiomqtt.MqttError as error:
        raise BrokerError(_in_words(error)) from None


def _in_words(error: aiomqtt.MqttError) -> str:
    """Why; with the reason the broker gave, where it gave one."""
    cause = error.__cause__ or error
    code = cause.rc if isinstance(cause, aiomqtt.MqttCodeError) else None
    if not isinstance(code, ReasonCode):
        return str(cause)
    return "connection lost" if code.value == UNSPECIFIED_ERROR else str(code)


@contextlib.contextmanager
def _cancellable() -> Iterator[None]:
    """Raises CancelledError that aiomqtt has swallowed.

    Up to Python 3.11, `asyncio.wait_for`, by which aiomqtt waits, forgets a cancellation that comes together
    with what it waits for. A task that goes on after that would hold up the end of its TaskGroup for ever.
    """
    task = asyncio.current_task()
    before = task.cancelling() if task is not None else 0
    yield
    if task is not None and task.cancelling() > before:
        raise asyncio.CancelledError
