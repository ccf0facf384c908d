"""Browsers without a screen: pages of the operator's bench, fetched and kept up to date as a browser would.

Run as `python -m tests.campaigns.bench.hmi_pages ADDRESS COUNT PATH...`. Says "open" once all are connected;
a line on standard input is answered with the updates received since the last one, "frames" with those of them
that were frames of charts; ends with standard input. What a browser draws costs nothing here: it is the
controller and the page's process that are measured. A frame is acknowledged at once, as a fast browser would.
"""

import asyncio
import json
import re
import sys
import uuid
from typing import Any

import aiohttp
import socketio

CONNECT_LIMIT_S = 60.0
CLIENT = re.compile(r"client_id\W+([0-9a-f-]{36})")
FRAME, DRAWN = "live_chart", "live_chart_drawn"
"""What a chart is sent (`servo_ctrl.hmi.charts.live_chart`), and what it answers."""


class Page:
    """One page that is open."""

    def __init__(self) -> None:
        self.updates = self.frames = 0
        self._client = ""
        self._web: aiohttp.ClientSession | None = None
        self._socket: socketio.AsyncClient | None = None

    async def open(self, address: str, path: str) -> None:
        self._web = aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True))
        async with self._web.get(address + path) as response:
            text = await response.text()
        found = CLIENT.search(text)
        if response.status != 200 or found is None:
            raise RuntimeError(f"{address}{path}: no page ({response.status})")
        self._client = found[1]
        query = {
            "client_id": self._client,
            "next_message_id": 0,
            "implicit_handshake": "true",
            "tab_id": uuid.uuid4(),
            "document_id": uuid.uuid4(),
        }
        self._socket = socketio.AsyncClient(http_session=self._web, reconnection=False)
        self._socket.on("*", self._heard)
        parameters = "&".join(f"{name}={value}" for name, value in query.items())
        await self._socket.connect(
            f"{address}/?{parameters}",
            headers={"Origin": address},
            transports=["websocket"],
            socketio_path="/_nicegui_ws/socket.io",
        )

    async def close(self) -> None:
        if self._socket is not None:
            await self._socket.disconnect()
        if self._web is not None:
            await self._web.close()

    async def _heard(self, event: str, *data: Any) -> None:
        self.updates += 1
        if event == FRAME and self._socket is not None:
            self.frames += 1
            header = json.loads(data[0])
            await self._socket.emit(DRAWN, (self._client, header["id"], header["number"]))


async def _until_served(address: str) -> None:
    async with aiohttp.ClientSession() as web:
        while True:
            try:
                async with web.get(address):
                    return
            except aiohttp.ClientConnectionError:
                await asyncio.sleep(0.2)


async def main() -> None:
    """Open, count, close."""
    address, count, paths = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
    pages = [Page() for _ in range(count)]
    try:
        async with asyncio.timeout(CONNECT_LIMIT_S):
            await _until_served(address)
            for number, page in enumerate(pages):
                await page.open(address, paths[number % len(paths)])
        print("open", flush=True)
        loop, seen = asyncio.get_running_loop(), {"updates": 0, "frames": 0}
        while question := await loop.run_in_executor(None, sys.stdin.readline):
            wanted = "frames" if question.strip() == "frames" else "updates"
            total = sum(getattr(page, wanted) for page in pages)
            print(total - seen[wanted], flush=True)
            seen[wanted] = total
    finally:
        await asyncio.gather(*(page.close() for page in pages), return_exceptions=True)


if __name__ == "__main__":
    asyncio.run(main())
