"""A Chromium without a screen that draws the Scope page, and gives way to the cycle."""

import asyncio
import contextlib
import os
import signal
from collections.abc import AsyncIterator
from pathlib import Path

import typer

from tests.support.browser_program import CHROMIUM

GIVE_WAY = ("sh", "-c", 'echo 19 > /proc/self/autogroup; exec "$0" "$@"')
"""Starts a program that gives way: Linux shares processors among sessions first, without `nice`; sched(7)."""
BROWSER = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"),
    *("--no-first-run", "--remote-debugging-port=0"),
)


@contextlib.asynccontextmanager
async def opened_browser(address: str, folder: Path) -> AsyncIterator[None]:
    """A browser with the Scope page, opened as soon as this is served: its start stalls a small computer."""
    if CHROMIUM is None:
        raise typer.BadParameter("there is no Chromium; install Debian's chromium-headless-shell")
    opening = asyncio.create_task(_open(CHROMIUM, address, folder))
    try:
        yield
    finally:
        opening.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await opening


async def _open(program: str, address: str, folder: Path) -> None:
    host, port = address.split(":")
    while True:
        try:
            _, writer = await asyncio.open_connection(host, int(port))
        except OSError:
            await asyncio.sleep(0.2)
            continue
        writer.close()
        break
    browser = await asyncio.create_subprocess_exec(
        *(*GIVE_WAY, program, *BROWSER, f"--user-data-dir={folder / 'browser'}", f"http://{address}/scope"),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
        start_new_session=True,  # Debian's program is a script that starts the browser
    )
    try:
        await browser.wait()
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(browser.pid, signal.SIGKILL)
        await browser.wait()
