"""A process that has loaded the programs of the project and forks one for each request on its socket.

Loading numba, NiceGUI, canopen and the kernels takes a program more processor time than most tests need. A
fork has them already; all else (arguments, folder, environment, streams, signals, exit) is as in a process of
its own. What a program needs is loaded when the first is asked for.

A request is the text of a tuple (`Request`), and beside it the descriptors of the three streams. The answer
is the process's number at once, and its exit status when it has ended, -N after signal N, as 4 bytes each.
The process is killed when the other side closes the connection. The template ends with the last process that
has the other end of its `life`.
"""

import ast
import contextlib
import gc
import importlib
import os
import pkgutil
import runpy
import selectors
import signal
import socket
import struct
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Never

XY_TABLE = Path(__file__).parents[2] / "machines" / "xy_table"
COMMANDS = {
    "servo-ctrl": "servo_ctrl.cli.main",
    "hil-sim": "hil_sim.cli.main",
    "reconcile": "reconcile.cli.main",
}
"""Console scripts, by the modules with their `main`."""
LONGEST_REQUEST_BYTES = 180_000


class Request(NamedTuple):
    """A program to be started: a console script, or `python3` with a module (`-m`)."""

    program: str
    arguments: list[str]
    directory: str
    environment: dict[str, str]


class Template:
    """Forks programs, and reports the end of each to its caller."""

    def __init__(self, listener: socket.socket, life: int, folder: Path) -> None:
        self._listener, self._life, self._folder = listener, life, folder
        self._callers: dict[int, socket.socket] = {}
        self._loaded: set[str] = set()
        self._ended, ends = os.pipe2(os.O_NONBLOCK)
        signal.set_wakeup_fd(ends)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        self._selector = selectors.DefaultSelector()
        for readable in (listener, life, self._ended):
            self._selector.register(readable, selectors.EVENT_READ)

    def serve(self) -> None:
        """Fork for each request until `life` ends."""
        while True:
            ready = [key.fileobj for key, _ in self._selector.select()]
            if self._life in ready:
                for pid in self._callers:
                    os.kill(pid, signal.SIGKILL)
                return
            if self._ended in ready:
                os.read(self._ended, 4096)
                self._report_ends()
            for caller in ready:
                if caller is self._listener:
                    self._accept()
                elif isinstance(caller, socket.socket):
                    self._caller_has_left(caller)

    def _accept(self) -> None:
        caller, _ = self._listener.accept()
        data, streams, _, _ = socket.recv_fds(caller, LONGEST_REQUEST_BYTES, 3)
        if not data:
            caller.close()
            return
        request = Request(*ast.literal_eval(data.decode()))
        self._load_for(request)
        pid = os.fork()
        if pid == 0:
            caller.close()
            self._leave()
            _become(request, streams, self._folder)
        for stream in streams:
            os.close(stream)
        with contextlib.suppress(OSError):  # the caller has been killed: its connection shows it
            caller.sendall(struct.pack("<i", pid))
        self._callers[pid] = caller
        self._selector.register(caller, selectors.EVENT_READ)

    def _report_ends(self) -> None:
        while self._callers:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if not pid:
                return
            caller = self._callers.pop(pid)
            self._forget(caller)
            with contextlib.suppress(OSError):
                caller.sendall(struct.pack("<i", os.waitstatus_to_exitcode(status)))
            caller.close()

    def _caller_has_left(self, caller: socket.socket) -> None:
        for pid, its_caller in self._callers.items():
            if its_caller is caller:
                self._forget(caller)
                os.kill(pid, signal.SIGKILL)

    def _forget(self, caller: socket.socket) -> None:
        with contextlib.suppress(KeyError):
            self._selector.unregister(caller)

    def _load_for(self, request: Request) -> None:
        for need, load in NEEDS.items():
            if need not in self._loaded and _needs(request, need):
                self._loaded.add(need)
                load()
                gc.collect()
                gc.freeze()  # no fork looks through what is loaded
                tasks = list(Path("/proc/self/task").iterdir())
                assert len(tasks) == 1, f"a fork would lack the threads of {need}"

    def _leave(self) -> None:
        """In the fork: close what is the template's."""
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        self._selector.close()
        for caller in (self._listener, *self._callers.values()):
            caller.close()
        os.close(self._life)
        os.close(self._ended)


def _needs(request: Request, need: str) -> bool:
    words = [request.program, *request.arguments[:2]]
    return need in words


def _become(request: Request, streams: list[int], folder: Path) -> Never:
    """Run the program in its folder, with its streams, environment and arguments."""
    for place, stream in enumerate(streams):
        os.dup2(stream, place)
        os.close(stream)
    status: Any = 0
    try:
        os.chdir(request.directory)
        os.environ.clear()
        os.environ.update(request.environment)
        sys.executable = str(folder / "python3")  # what it starts is forked as well
        _run(request)
    except SystemExit as left:
        status = left.code
        if isinstance(status, str):
            print(status, file=sys.stderr)
            status = 1
    except KeyboardInterrupt:
        status = 128 + signal.SIGINT
    except BaseException:  # noqa: BLE001  # as the interpreter would
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(int(status or 0))


def _run(request: Request) -> None:
    program, arguments = request.program, request.arguments
    if program in COMMANDS:
        sys.argv = [program, *arguments]
        sys.exit(importlib.import_module(COMMANDS[program]).main())
    sys.argv = arguments[1:]
    sys.path.insert(0, request.directory)
    runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)


def _load_modules(*packages: str) -> None:
    """Import all modules of packages but their commands."""
    for name in packages:
        package = importlib.import_module(name)
        for module in pkgutil.walk_packages(package.__path__, f"{name}."):
            if not module.name.endswith("__main__") and not module.name.startswith("servo_ctrl.hmi"):
                importlib.import_module(module.name)


def _load_hub() -> None:
    importlib.import_module("local_can.bus")
    importlib.import_module("local_can.hub")


def _load_simulator() -> None:
    _load_hub()
    from hil_sim.cli import main  # noqa: F401, PLC0415
    from hil_sim.config import load_plant  # noqa: PLC0415
    from hil_sim.runner.bench import SimulatedMachine  # noqa: PLC0415

    SimulatedMachine(load_plant(XY_TABLE), send=lambda _can_id, _data: None)


def _load_controller() -> None:
    _load_hub()
    _load_modules("servo_ctrl")
    from servo_ctrl.cli.compile_kernels import compile_kernels  # noqa: PLC0415

    compile_kernels(XY_TABLE)


def _load_pages() -> None:
    importlib.import_module("servo_ctrl.hmi.app")
    from patient_pages import make_pages_patient  # noqa: PLC0415

    make_pages_patient()


NEEDS: dict[str, Callable[[], None]] = {
    "local_can": _load_hub,
    "tests.support.paced_hub": _load_hub,
    "hil-sim": _load_simulator,
    "hil_sim.cli.main": _load_simulator,
    "servo-ctrl": _load_controller,
    "experiment": lambda: _load_modules("studies"),
    "servo_ctrl.hmi": _load_pages,
    "tests.browser.stub_server": _load_pages,
    "reconcile": lambda: _load_modules("reconcile"),
}
"""By program, subcommand or module: what loads that which it needs."""


def main() -> None:
    """Serve the listening socket and the `life` whose descriptors are the arguments."""
    listener, life, folder = sys.argv[1:]
    with socket.socket(fileno=int(listener)) as requests:
        Template(requests, int(life), Path(folder)).serve()


if __name__ == "__main__":
    main()
