"""A minimal MQTT broker in the process of the run, which can close or stop responding."""

from __future__ import annotations

import asyncio

CONNECT, PUBLISH = 1, 3
VERSION_5 = 5


class Broker:
    """Serves MQTT 3.1.1 and 5. `received` counts the published messages."""

    def __init__(self) -> None:
        self.port = 0
        self.received = 0
        self._unresponsive = False
        self._server: asyncio.Server | None = None
        self._writers: set[asyncio.StreamWriter] = set()

    async def start(self) -> None:
        """Listen on a free port."""
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """Close the broker and all its connections."""
        if self._server is not None:
            self._server.close()
        for writer in self._writers:
            writer.transport.abort()

    def stop_responding(self) -> None:
        """Respond to nothing from now on; the connections stay open."""
        self._unresponsive = True

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.add(writer)
        version = VERSION_5
        try:
            while True:
                kind, body = await _read_packet(reader)
                if kind >> 4 == CONNECT:
                    version = body[6]
                if kind >> 4 == PUBLISH:
                    self.received += 1
                if not self._unresponsive and (response := _response(kind, body, version)):
                    writer.write(response)
        except (asyncio.IncompleteReadError, ConnectionError):
            writer.transport.abort()
        finally:
            self._writers.discard(writer)


async def _read_packet(reader: asyncio.StreamReader) -> tuple[int, bytes]:
    """Return the first byte, type and flags, and the body of a packet."""
    kind, size, shift = (await reader.readexactly(1))[0], 0, 0
    while True:
        byte = (await reader.readexactly(1))[0]
        size |= (byte & 0x7F) << shift
        shift += 7
        if not byte & 0x80:
            return kind, await reader.readexactly(size)


def _response(kind: int, body: bytes, version: int) -> bytes:
    """Return the response to a packet; b"" = none."""
    is_version_5 = version == VERSION_5
    match kind >> 4:
        case 1:  # CONNECT -> CONNACK
            return b"\x20\x03\x00\x00\x00" if is_version_5 else b"\x20\x02\x00\x00"
        case 8:  # SUBSCRIBE -> SUBACK
            return b"\x90\x04" + body[:2] + b"\x00\x01" if is_version_5 else b"\x90\x03" + body[:2] + b"\x01"
        case 3:  # PUBLISH -> PUBACK or PUBREC
            quality_of_service = kind >> 1 & 3
            size = int.from_bytes(body[:2], "big")
            packet_id = body[2 + size : 4 + size]
            return {0: b"", 1: b"\x40\x02" + packet_id, 2: b"\x50\x02" + packet_id}[quality_of_service]
        case 6:  # PUBREL -> PUBCOMP
            return b"\x70\x02" + body[:2]
        case 12:  # PINGREQ -> PINGRESP
            return b"\xd0\x00"
    return b""
