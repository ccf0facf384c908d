"""Runs the tests in forks of the process that has collected them: `pytest --workers auto`.

Collecting takes a worker of pytest-xdist 30 s of processor time in a fresh clone (imports, rewriting of
asserts), and each worker collects everything. Here one process collects, and its forks have what it has
loaded (decision 0024). A fork runs whole files, so that their fixtures are made once, and takes the next file
when it has done one.
"""

import gc
import multiprocessing
import os
from collections.abc import Iterator
from itertools import groupby
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pytest
from forked_program import commands_folder

FORK = multiprocessing.get_context("fork")
Files = list[list[pytest.Item]]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the option."""
    words = "run the tests in N forks of this process; auto: two more than there are processors"
    parser.addoption("--workers", default="0", metavar="N", help=words)


def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Run the tests in forks if the option is set, and pass their reports to pytest."""
    count = worker_count(str(session.config.getoption("--workers")))
    if not count or session.config.option.collectonly or session.testsfailed:
        return None  # pytest's own loop runs them, or says that collecting has failed
    session.config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]  # one for all
    commands_folder()  # one template of programs for all
    files = [list(items) for _, items in groupby(session.items, lambda item: item.path)]
    taken = FORK.Value("i", 0)
    gc.collect()
    gc.freeze()  # the collected tests stay: no fork looks through them again
    forks: dict[Connection, BaseProcess] = {}
    try:
        for _ in range(count):
            reports, reporting = FORK.Pipe(duplex=False)
            fork = FORK.Process(target=run_files, args=(session, files, taken, reporting))
            fork.start()
            reporting.close()
            forks[reports] = fork
        pass_on_reports(session, dict(forks))
    finally:
        for fork in forks.values():
            fork.terminate()
    return True


def worker_count(wanted: str) -> int:
    """Return the number of forks: more than processors, because tests of a page, a bus or a broker wait."""
    return 2 + len(os.sched_getaffinity(0)) if wanted == "auto" else int(wanted)


def run_files(session: pytest.Session, files: Files, taken: Any, reporting: Connection) -> None:
    """In a fork: run files until all are taken. The session is ended by the process that forked."""
    plugins = session.config.pluginmanager
    capture = plugins.getplugin("capturemanager")
    capture.stop_global_capturing()  # forks would share the files behind it
    capture.start_global_capturing()
    capture.suspend_global_capture()
    with Path(os.devnull).open("w") as nowhere:
        session.config.get_terminal_writer()._file = nowhere
        plugins.register(Reporting(session.config, reporting))
        item = None
        for following in taken_tests(files, taken):
            run(session, item, following)
            item = following
        run(session, item, None)


def run(session: pytest.Session, item: pytest.Item | None, following: pytest.Item | None) -> None:
    """Run a test; fixtures that the following one does not share are torn down."""
    if item is not None:
        session.config.hook.pytest_runtest_protocol(item=item, nextitem=following)


def taken_tests(files: Files, taken: Any) -> Iterator[pytest.Item]:
    """Yield the tests of files that no other fork has taken."""
    while True:
        with taken.get_lock():
            place = taken.value
            taken.value += 1
        if place >= len(files):
            return
        yield from files[place]


class Reporting:
    """In a fork: sends reports, and the start of each test, so that a test that ends the fork is known."""

    def __init__(self, config: pytest.Config, reporting: Connection) -> None:
        self._hook = config.hook
        self._config = config
        self._send = reporting.send

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Send the id of a test that begins."""
        self._send(nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Send the report of a phase of a test."""
        self._send(self._hook.pytest_report_to_serializable(config=self._config, report=report))


def pass_on_reports(session: pytest.Session, forks: dict[Connection, BaseProcess]) -> None:
    """Pass the reports of the forks to pytest until all have ended."""
    hook, config, running = session.config.hook, session.config, dict.fromkeys(forks, "no test")
    lost = []
    while forks:
        for reports in wait(list(forks)):
            assert isinstance(reports, Connection)
            try:
                data = reports.recv()
            except EOFError:
                fork = forks.pop(reports)
                fork.join()
                if fork.exitcode:
                    lost.append(f"{running[reports]} ended its process with {fork.exitcode}")
                continue
            if isinstance(data, str):
                running[reports] = data
                continue
            hook.pytest_runtest_logreport(
                report=hook.pytest_report_from_serializable(config=config, data=data)
            )
            if session.shouldfail:
                raise session.Failed(session.shouldfail)
            if session.shouldstop:
                raise session.Interrupted(session.shouldstop)
    if lost:
        raise pytest.UsageError(f"{'; '.join(lost)}: what it had yet to run was not run")
