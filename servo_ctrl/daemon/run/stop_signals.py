"""SIGINT and SIGTERM, which ask for a controlled stop."""

import asyncio
import contextlib
import signal
import threading
from collections.abc import Callable, Iterator

from servo_ctrl.errors import ServoCtrlError

WANTED = (signal.SIGINT, signal.SIGTERM)


class StoppedError(ServoCtrlError):
    """A signal came before anything moved."""


@contextlib.contextmanager
def stop_signals(on_signal: Callable[[str], None]) -> Iterator[None]:
    """Tell `on_signal` their names while the block runs; outside the main thread they are not ours."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()
    for number in WANTED:
        loop.add_signal_handler(number, on_signal, number.name)
    try:
        yield
    finally:
        for number in WANTED:
            loop.remove_signal_handler(number)
