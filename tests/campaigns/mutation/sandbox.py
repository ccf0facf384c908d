"""Where mutants live: a copy of the sources, so that nobody else reads one; and a fork for each of them."""

import gc
import importlib
import os
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

import hypothesis
import pytest
from _pytest.config import default_plugins

COPIED = (
    "kernels",
    "servo_ctrl",
    "hil_sim",
    "local_can",
    "can_frames",
    "reconcile",
    "tests",
    "docs",
    "eds",
    "machines",
    "pyproject.toml",
)
LEFT_OUT = shutil.ignore_patterns("__pycache__", "*.png", "learned")
LOADED = (
    *("numpy", "numba", "asyncio", "pydantic", "canopen", "hypothesis.strategies", "pytest_asyncio.plugin"),
    *(f"_pytest.{name}" for name in default_plugins),
)
"""What the children find loaded."""
OPTIONS = (  # without conftest.py, whose imports take longer than the tests; no test about a target needs one
    *("-x", "-q", "--no-header", "--tb=line", "--assert=plain", "--noconftest"),
    *(f"-pno:{name}" for name in ("cacheprovider", "unraisableexception", "threadexception", "logging")),
    *("-ppytest_asyncio.plugin", "-ppytest_timeout"),
    *("-W", "ignore:Module already imported:pytest.PytestAssertRewriteWarning"),
)
KILLED, SURVIVED, TIMED_OUT = "killed", "survived", "timed out"


def copy_sources(repository: Path, folder: Path) -> None:
    """A fresh copy; kernels that were compiled in an earlier one stay usable, as times of files are kept."""
    for name in COPIED:
        source, copy = repository / name, folder / name
        if source.is_dir():
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(source, copy, ignore=LEFT_OUT)
        else:
            shutil.copy2(source, copy)


def load_libraries() -> None:
    """Once, for all children."""
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # a kernel's mutant would be compiled for longer than it runs
    for name in LOADED:
        importlib.import_module(name)
    hypothesis.settings.register_profile(
        "mutants",
        deadline=None,
        derandomize=True,
        database=None,
        phases=(hypothesis.Phase.explicit, hypothesis.Phase.generate),  # a failure need not be made small
    )
    hypothesis.settings.load_profile("mutants")
    gc.freeze()  # a child need not look for rubbish in what it has inherited


def outcome(
    folder: Path, tests: Sequence[str], limit_s: float, left_out: Sequence[str] = ()
) -> tuple[str, float]:
    """Run tests in the copy in a child of ours, which has the libraries loaded; what became of them, seconds.

    No compiled file is written, for a mutant of the same size in the same second would be taken for the last.
    """
    started_s = time.monotonic()
    child = os.fork()
    if child == 0:
        _be_the_child(folder, tests, left_out)
    deadline_s = started_s + limit_s
    while True:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            break
        if time.monotonic() > deadline_s:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return TIMED_OUT, limit_s
        time.sleep(0.01)
    passed = os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0
    return (SURVIVED if passed else KILLED), time.monotonic() - started_s


def _be_the_child(folder: Path, tests: Sequence[str], left_out: Sequence[str]) -> None:
    code = 1
    try:
        quiet = os.open(folder / "pytest.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        os.chdir(folder)
        sys.path.insert(0, str(folder))
        sys.dont_write_bytecode = True
        os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
        left = [option for test in left_out for option in ("--deselect", test)]
        options = [*OPTIONS, "--rootdir", str(folder), *left]
        for test in tests:  # one by one: what the first file kills does not wait for what others import
            code = int(pytest.main([*options, test]))
            if code != 0:
                break
    except BaseException:  # noqa: BLE001  # a child must not come back as a second parent
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
