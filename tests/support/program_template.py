"""A process that has loaded the programs of the project and forks one for each request on its socket.

Loading numba, canopen and the kernels takes a program more processor time than most tests on the bus need. A
fork has them already; all else (arguments, streams, signals, exit) is as in a process of its own.

A request is a JSON object with `program` (its entry point as module:function) and `arguments`, and beside it
the file descriptors for the output and for the answer. The answer is the process's number at once, and its
exit status when it has ended, -N after signal N, as 4 bytes each.
"""

import importlib
import json
import os
import signal
import socket
import struct
import sys
import traceback
from pathlib import Path
from typing import Any, Never

import local_can.__main__
import local_can.bus  # noqa: F401
from hil_sim.config import load_plant
from hil_sim.runner.bench import SimulatedMachine

XY_TABLE = Path(__file__).parents[2] / "machines" / "xy_table"
LONGEST_REQUEST_BYTES = 65536


def serve(requests: socket.socket) -> None:
    """Fork for each request until the other side closes its end."""
    while True:
        data, descriptors, _, _ = socket.recv_fds(requests, LONGEST_REQUEST_BYTES, 2)
        if not data:
            return
        output, answer = descriptors
        if os.fork() == 0:
            requests.close()
            _keep(json.loads(data), output, answer)
        os.close(output)
        os.close(answer)


def _keep(request: dict[str, Any], output: int, answer: int) -> Never:
    """Fork the program; answer with its process id and its exit status."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    pid = os.fork()
    if pid == 0:
        os.close(answer)
        _become(request, output)
    os.close(output)
    with socket.socket(fileno=answer) as caller:
        caller.sendall(struct.pack("<i", pid))
        _, status = os.waitpid(pid, 0)
        caller.sendall(struct.pack("<i", os.waitstatus_to_exitcode(status)))
    os._exit(0)


def _become(request: dict[str, Any], output: int) -> Never:
    """Run the program with its streams and arguments."""
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    status: Any = 0
    try:
        module, _, function = request["program"].partition(":")
        sys.argv = [module, *request["arguments"]]
        status = getattr(importlib.import_module(module), function)()
    except SystemExit as left:
        status = left.code
        if isinstance(status, str):
            print(status, file=sys.stderr)
            status = 1
    except BaseException:  # noqa: BLE001  # as the interpreter would
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(int(status or 0))


def main() -> None:
    """Load the kernels, then serve the socket whose descriptor is the argument."""
    SimulatedMachine(load_plant(XY_TABLE), send=lambda _can_id, _data: None)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for those who keep a program
    with socket.socket(fileno=int(sys.argv[1])) as requests:
        serve(requests)


if __name__ == "__main__":
    main()
