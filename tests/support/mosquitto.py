"""A Mosquitto broker for one test, and its command line clients as the communication partner."""

import asyncio
import contextlib
import getpass
import json
import shutil
import subprocess
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any, NamedTuple, Self

import pytest
from free_port import free_tcp_port

LIMIT_S = 60.0
ARRIVAL_LIMIT_S = 300.0
"""Time in which a controller starts and runs its program while many programs share two processors."""
SERVER = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/sbin")
needs_mosquitto = pytest.mark.skipif(
    SERVER is None or shutil.which("mosquitto_sub") is None, reason="mosquitto is not installed"
)


class Message(NamedTuple):
    """A message as mosquitto_sub prints it."""

    retained: bool
    qos: int
    topic: str
    payload: str

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object in the payload."""
        found = json.loads(self.payload)
        assert isinstance(found, dict)
        return found


class Listener:
    """A running mosquitto_sub."""

    def __init__(self, stream: asyncio.StreamReader) -> None:
        self.received: list[Message] = []
        self._stream = stream
        self._again: list[Message] = []

    async def until(self, topic: str, wanted: Callable[[Message], bool] = lambda _message: True) -> Message:
        """Return the next matching message of a topic with this end. Raises TimeoutError where none comes."""
        async with asyncio.timeout(ARRIVAL_LIMIT_S):
            while True:
                message = self._again.pop(0) if self._again else await self._next()
                self.received.append(message)
                if message.topic.endswith(topic) and wanted(message):
                    return message

    def rewind(self) -> None:
        """Start again with the first received message."""
        self._again, self.received = self.received + self._again, []

    async def _next(self) -> Message:
        line = (await self._stream.readline()).decode(errors="replace").rstrip("\n")
        assert line, f"mosquitto_sub ended; it had received {self.received}"
        retained, qos, topic, payload = line.split("|", 3)
        return Message(retained == "1", int(qos), topic, payload)


class Mosquitto:
    """One broker on a free port; `settings` are further lines of its configuration."""

    def __init__(self, folder: Path, settings: str = "allow_anonymous true") -> None:
        self.port = free_tcp_port()
        self.login: list[str] = []
        """Options with which the command line clients authenticate."""
        self._configuration = folder / "mosquitto.conf"
        self._log = folder / "mosquitto.log"
        self._configuration.write_text(
            f"user {getpass.getuser()}\npersistence false\nlistener {self.port} 127.0.0.1\n{settings}\n"
        )
        self._process: subprocess.Popen[bytes] | None = None

    async def start(self) -> None:
        """Start the broker; return when it accepts connections."""
        assert SERVER is not None
        with self._log.open("ab") as log:
            command = [SERVER, "-c", str(self._configuration)]
            self._process = subprocess.Popen(command, stdout=log, stderr=log)  # noqa: ASYNC220  # fixtures end it
        async with asyncio.timeout(LIMIT_S):
            while True:
                assert self._process.poll() is None, self._log.read_text()
                with contextlib.suppress(OSError):
                    _, writer = await asyncio.open_connection("127.0.0.1", self.port)
                    writer.close()
                    await writer.wait_closed()
                    return
                await asyncio.sleep(0.02)

    async def __aenter__(self) -> Self:
        await self.start()
        return self

    async def __aexit__(self, *_exception: object) -> None:
        self.kill()

    def signal(self, number: int) -> None:
        """Send a signal to the broker; SIGSTOP makes it hang."""
        assert self._process is not None
        self._process.send_signal(number)

    def kill(self) -> None:
        """Kill the broker; retained messages are lost."""
        if self._process is not None:
            self._process.kill()
            self._process.wait(LIMIT_S)
            self._process = None

    async def publish(self, topic: str, payload: bytes | str, *options: str) -> None:
        """Publish with QoS 1, by mosquitto_pub."""
        payload = payload.encode() if isinstance(payload, str) else payload
        process = await asyncio.create_subprocess_exec(
            *("mosquitto_pub", *self._address(), "-V", "5", "-q", "1", "-t", topic, *options),
            *(("-s",) if payload else ("-n",)),
            stdin=asyncio.subprocess.PIPE,
        )
        async with asyncio.timeout(LIMIT_S):
            await process.communicate(payload)
        assert process.returncode == 0

    @contextlib.asynccontextmanager
    async def listener(self, *topics: str) -> AsyncIterator[Listener]:
        """Start a subscriber; enter when the broker has accepted its subscriptions."""
        mark = "mark/of/the/listener"
        await self.publish(mark, "here", "-r")
        wanted = [part for topic in (*topics, mark) for part in ("-t", topic)]
        process = await asyncio.create_subprocess_exec(
            *("mosquitto_sub", *self._address(), "-V", "5", "-q", "1", "-F", "%r|%q|%t|%p", *wanted),
            stdout=asyncio.subprocess.PIPE,
            limit=1_000_000,
        )
        assert process.stdout is not None
        try:
            listener = Listener(process.stdout)
            await listener.until(mark)
            listener.received.pop()
            listener.rewind()
            yield listener
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.communicate()

    def _address(self) -> list[str]:
        return ["-h", "127.0.0.1", "-p", str(self.port), *self.login]
