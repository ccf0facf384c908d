"""SIGINT and SIGTERM, which request a controlled stop."""

import asyncio
import contextlib
import signal
import threading
from collections.abc import Callable, Iterator

from servo_ctrl.errors import ServoCtrlError

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StoppedError(ServoCtrlError):
    """A signal arrived before anything moved; the command ends as after any signal."""

    def __init__(self, name: str) -> None:
        super().__init__(f"stopped by {name} before anything moved")
        self.exit_status = exit_status_after(name)


def exit_status_after(name: str) -> int:
    """Return the exit status of a command that this signal ended: 128 + its number, as in a shell."""
    return 128 + signal.Signals[name].value


@contextlib.contextmanager
def stop_signals(on_signal: Callable[[str], None]) -> Iterator[None]:
    """Call `on_signal` with the signal's name while the block runs; do nothing outside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()
    for number in SIGNALS:
        loop.add_signal_handler(number, on_signal, number.name)
    try:
        yield
    finally:
        for number in SIGNALS:
            loop.remove_signal_handler(number)
