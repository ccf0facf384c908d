"""`pytest --workers N`: each test runs once, a file in one process; a lost process is noticed."""

import os
import subprocess
import sys
from pathlib import Path

SUPPORT = Path(__file__).parents[2] / "support"
FILE = """
import os, pytest

@pytest.fixture(scope="module")
def process():
    print(f"made in {os.getpid()}")
    yield os.getpid()
    with open("ended", "a") as file:
        file.write("x")

def test_first(process): assert process == os.getpid()
def test_second(process): assert process == os.getpid()
@pytest.mark.skip(reason="none of ours")
def test_skipped(): pass
"""


def run(folder: Path, *arguments: str) -> tuple[int, str]:
    (folder / "conftest.py").write_text("from forked_workers import pytest_addoption, pytest_runtestloop\n")
    command = [sys.executable, "-m", "pytest", "-rs", "-p", "no:cacheprovider", "--workers", "2", *arguments]
    ended = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(SUPPORT)},
        capture_output=True,
        text=True,
        check=False,
    )
    return ended.returncode, ended.stdout + ended.stderr


def test_every_test_is_run_once_and_reported(tmp_path: Path) -> None:
    for number in range(5):
        (tmp_path / f"test_{number}.py").write_text(FILE)
    (tmp_path / "test_bad.py").write_text("def test_bad():\n    print('seen')\n    assert 1 == 2\n")
    status, output = run(tmp_path)
    assert status == 1
    assert "1 failed, 10 passed, 5 skipped" in output
    assert "assert 1 == 2" in output
    assert "Captured stdout call" in output
    assert "none of ours" in output
    assert (tmp_path / "ended").read_text() == "xxxxx"  # each file's fixture made and torn down once


def test_a_test_that_ends_its_process_is_named(tmp_path: Path) -> None:
    (tmp_path / "test_end.py").write_text("import os\ndef test_end():\n    os._exit(9)\n")
    status, output = run(tmp_path)
    assert status == 4
    assert "test_end.py::test_end ended its process with 9" in output


def test_the_first_failure_ends_the_run_on_request(tmp_path: Path) -> None:
    (tmp_path / "test_bad.py").write_text("def test_bad():\n    assert False\n\ndef test_next():\n    pass\n")
    status, output = run(tmp_path, "-x")
    assert status == 1
    assert "stopping after 1 failures" in output
