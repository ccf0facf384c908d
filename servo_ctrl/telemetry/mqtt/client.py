"""A connection to an MQTT broker: the only file that uses aiomqtt (and paho-mqtt below it).

It uses MQTT 5 with a clean start, so that commands sent while the controller was away are not delivered
later. The asyncio loop reads and writes a non-blocking socket; only name look-up, TCP connect and TLS
handshake run in a thread of aiomqtt. Every wait is bounded.
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

RESPONSE_LIMIT_S = 5.0
"""Bounds the wait for CONNACK, SUBACK and PUBACK; paho's bound for TCP and TLS is the same."""
CLOSING_LIMIT_S = 1.0
"""Bounds the end of a connection, seconds; chosen."""
MESSAGES_WAITING_MAX = 1000
"""Bounds the received messages that wait; further ones are lost; chosen."""
PACKET_LIMIT = 65536
"""Bounds the bytes of a packet; the broker does not send larger ones."""
UNSPECIFIED_ERROR = 0x80
"""Reason code of MQTT 5, which paho uses when it has no other."""

_LOG = logging.getLogger(__name__)
# Both libraries log every lost connection at every attempt; the link logs it once.
_SILENT = logging.getLogger(f"{__name__}.library")
_SILENT.addHandler(logging.NullHandler())
_SILENT.propagate = False


class BrokerError(Exception):
    """The connection to the broker failed or ended; the text gives the reason."""


class Incoming(NamedTuple):
    """A message from the broker."""

    topic: str
    payload: bytes
    retained: bool
    """Whether the message was published with the retain flag."""


class Will(NamedTuple):
    """A retained message that the broker publishes when our connection is lost."""

    topic: str
    payload: bytes


class Broker:
    """Connects to the broker. Raises ConfigError when a password or certificate cannot be read."""

    def __init__(self, config: MqttConfig, client_id: str, will: Will | None = None) -> None:
        self._config, self._client_id = config, config.client_id or client_id
        self._will = None if will is None else aiomqtt.Will(will.topic, will.payload, qos=1, retain=True)
        self._password = None if config.password_file is None else password_in(config.password_file)
        self._tls = tls_context(config) if config.tls else None
        self._properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]  # paho's
        self._properties.MaximumPacketSize = PACKET_LIMIT

    @property
    def address(self) -> str:
        """Host and port, for messages."""
        return f"{self._config.host}:{self._config.port}"

    @contextlib.asynccontextmanager
    async def connection(self) -> AsyncIterator["Connection"]:
        """Keep a connection while the block runs. Raises BrokerError when it fails or ends."""
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
            timeout=RESPONSE_LIMIT_S,
            max_queued_incoming_messages=MESSAGES_WAITING_MAX,
            logger=_SILENT,
        )
        try:
            try:
                with _as_broker_error():
                    await _enter(client)
            except BrokerError as error:
                # TLS 1.3 ends the handshake before the broker has checked our certificate
                silent = self._tls is not None and "timed out" in str(error)
                hint = ": it is away, or refuses our certificate" if silent else ""
                raise BrokerError(f"{error}{hint}") from None
            yield Connection(client)
        finally:
            await _leave(client)


class _RefusalReporter(aiomqtt.Client):
    """Logs once a connection that the broker refuses messages, which aiomqtt counts as sent."""

    _refused = False

    def _on_publish(  # the callback of paho; aiomqtt ignores the reason code
        self, client: Any, userdata: Any, mid: int, reason_code: ReasonCode, properties: Properties
    ) -> None:
        if reason_code.is_failure and not self._refused:
            self._refused = True
            _LOG.warning("MQTT: the broker refuses messages of %s: %s", self.identifier, reason_code)
        super()._on_publish(client, userdata, mid, reason_code, properties)


class Connection:
    """Publishes and receives messages while connected."""

    def __init__(self, client: aiomqtt.Client) -> None:
        self._client = client

    async def publish(self, topic: str, payload: bytes, *, qos: int = 1, retain: bool = False) -> None:
        """Send a message; with QoS 1 return after the broker has confirmed it."""
        with _as_broker_error(), _cancellable():
            await self._client.publish(topic, payload, qos, retain)

    async def subscribe(self, topic: str) -> str:
        """Subscribe to a topic with QoS 1; return why the broker refuses, else ""."""
        # makes a retained message recognisable even when it is delivered at its publication
        options = SubscribeOptions(qos=1, retainAsPublished=True)
        with _as_broker_error(), _cancellable():
            (code,) = await self._client.subscribe(topic, options=options)
        return "" if isinstance(code, int) or not code.is_failure else str(code)

    async def messages(self) -> AsyncIterator[Incoming]:
        """Yield the messages on the subscribed topics."""
        with _as_broker_error():
            async for message in self._client.messages:
                yield Incoming(message.topic.value, bytes(message.payload), message.retain)

    async def left_over(self) -> AsyncIterator[Incoming]:
        """Yield the messages confirmed to the broker but not read before the connection ended."""
        messages = self._client.messages
        while len(messages):
            message = await anext(messages)
            yield Incoming(message.topic.value, bytes(message.payload), message.retain)


async def _enter(client: aiomqtt.Client) -> None:
    """Connect. Because aiomqtt's thread cannot be cancelled, close a connection that it opens late."""
    entering = asyncio.create_task(client.__aenter__())
    try:
        await asyncio.shield(entering)
    except asyncio.CancelledError:
        await asyncio.wait((entering,), timeout=CLOSING_LIMIT_S)
        entering.cancel()
        await asyncio.gather(entering, return_exceptions=True)
        raise
    finally:
        del entering  # a failed task references itself, and so its socket, until garbage collection


async def _leave(client: aiomqtt.Client) -> None:
    """Disconnect in order if possible, and close the socket in any case."""
    with contextlib.suppress(aiomqtt.MqttError, TimeoutError):
        async with asyncio.timeout(CLOSING_LIMIT_S):
            await client.__aexit__(None, None, None)
    # After a timeout of connect or disconnect, aiomqtt keeps the socket, its reader and a task. Paho drops
    # all three when the stream ends, but there is no public access to the stream.
    paho = client._client  # noqa: SLF001
    open_socket = cast("socket.socket | None", paho.socket())
    if open_socket is None:
        return
    with contextlib.suppress(OSError):
        open_socket.shutdown(socket.SHUT_RDWR)
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(CLOSING_LIMIT_S):
            while paho.socket() is not None:  # noqa: ASYNC110  # paho notifies only aiomqtt
                await asyncio.sleep(0.01)


@contextlib.contextmanager
def _as_broker_error() -> Iterator[None]:
    try:
        yield
    except aiomqtt.MqttError as error:
        raise BrokerError(_in_words(error)) from None


def _in_words(error: aiomqtt.MqttError) -> str:
    """Return the reason of an error, preferably the reason code of the broker."""
    cause = error.__cause__ or error
    code = cause.rc if isinstance(cause, aiomqtt.MqttCodeError) else None
    if not isinstance(code, ReasonCode):
        return str(cause)
    return "connection lost" if code.value == UNSPECIFIED_ERROR else str(code)


@contextlib.contextmanager
def _cancellable() -> Iterator[None]:
    """Raise a CancelledError that aiomqtt has swallowed.

    Up to Python 3.11 `asyncio.wait_for`, which aiomqtt uses, loses a cancellation that arrives together with
    the awaited result. A task that continued after that would block the end of its TaskGroup for ever.
    """
    task = asyncio.current_task()
    before = task.cancelling() if task is not None else 0
    yield
    if task is not None and task.cancelling() > before:
        raise asyncio.CancelledError
