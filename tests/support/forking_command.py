"""In the place of python3 or a console script: has the program forked by a template, and stands for it.

Arguments: the template's socket, the name of the command, the command's own. It passes on streams, folder,
environment and signals, and ends as the program does. Files, and modules that are not named below, are run by
Python itself. Its niceness it does not pass on: beside four workers, a diagnosis that gives way never ends.
"""

import os
import signal
import socket
import struct
import sys
from types import FrameType

MODULES = (
    "local_can",
    "tests.support.paced_hub",
    "hil_sim.cli.main",
    "servo_ctrl.hmi",
    "tests.browser.stub_server",
)
"""Beginnings of their names."""
SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2)


def main() -> None:
    """Run the command."""
    address, name, *arguments = sys.argv[1:]
    environment = {key: text for key, text in os.environ.items() if not key.startswith("PYTEST_")}
    if name == "python3" and not is_known(arguments):
        os.execve(sys.executable, [sys.executable, *arguments], environment)  # noqa: S606  # it is Python
    pid, waiting = 0, list[int]()

    def pass_on(number: int, _frame: FrameType | None) -> None:
        if pid:
            os.kill(pid, number)
        else:
            waiting.append(number)

    for number in SIGNALS:
        signal.signal(number, pass_on)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as template:
        template.connect(address)
        request = (name, arguments, os.getcwd(), environment)  # noqa: PTH109  # pathlib takes longer
        socket.send_fds(template, [repr(request).encode()], [0, 1, 2])
        for stream in (0, 1, 2):
            os.close(stream)  # the program has them; a reader sees its end
        (pid,) = struct.unpack("<i", template.recv(4))
        for number in waiting:
            os.kill(pid, number)
        (status,) = struct.unpack("<i", template.recv(4))
    if status < 0:
        signal.signal(-status, signal.SIG_DFL)
        os.kill(os.getpid(), -status)
    os._exit(status)


def is_known(arguments: list[str]) -> bool:
    """Whether the template runs `python3` with these arguments."""
    first, second = [*arguments, "", ""][:2]
    return first == "-m" and second.startswith(MODULES)


if __name__ == "__main__":
    main()
