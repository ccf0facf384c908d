"""Location and access of the local socket, and what a killed controller leaves."""

import os
import socket
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from local_socket_bench import LocalSocketBench, connected

from servo_ctrl.telemetry.local_socket.place import (
    NAME,
    PREFIX,
    YOUNG_S,
    LocalSocketError,
    remove_left_directories,
)


@pytest.fixture
async def bench() -> LocalSocketBench:
    return LocalSocketBench()


async def test_socket_is_for_its_owner_alone_and_goes_with_the_server(bench: LocalSocketBench) -> None:
    async with bench.server.serving() as socket:
        assert stat.S_IMODE(socket.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(socket.stat().st_mode) == 0o600
    assert not socket.parent.exists()


async def test_socket_at_a_chosen_path_needs_a_private_directory(
    bench: LocalSocketBench, tmp_path: Path
) -> None:
    directory = tmp_path / "run"
    with pytest.raises(LocalSocketError, match="make it, mode 700"):
        await bench.server.serving(directory / "page.sock").__aenter__()
    directory.mkdir(0o755)
    with pytest.raises(LocalSocketError, match="chmod 700"):
        await bench.server.serving(directory / "page.sock").__aenter__()
    directory.chmod(0o700)
    (directory / "file").touch()
    with pytest.raises(LocalSocketError, match="is not a socket"):
        await bench.server.serving(directory / "file").__aenter__()
    async with bench.server.serving(directory / "page.sock") as path, connected(path) as client:
        assert (await client.message())["kind"] == "hello"
    assert sorted(entry.name for entry in directory.iterdir()) == ["file"]


async def test_socket_of_a_running_controller_is_kept_and_that_of_a_killed_one_replaced(
    bench: LocalSocketBench, tmp_path: Path
) -> None:
    left = tmp_path / "page.sock"
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(left))
        other.listen()
        with pytest.raises(LocalSocketError, match="another controller serves it"):
            await bench.server.serving(left).__aenter__()
    async with bench.server.serving(left) as path, connected(path) as client:
        assert (await client.message())["kind"] == "hello"


def left(directory: Path, age_s: float = 2.0 * YOUNG_S) -> Path:
    """As a killed controller leaves it: a socket that nobody serves."""
    directory.mkdir(0o700)
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(directory / NAME))
    then_s = time.time() - age_s
    os.utime(directory, (then_s, then_s))
    return directory


def inside(directory: Path) -> list[Path]:
    return sorted(directory.iterdir())


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The system's temporary directory."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


async def test_directory_of_a_killed_controller_is_removed_by_the_next_one(
    bench: LocalSocketBench, temporary: Path
) -> None:
    gone = left(temporary / f"{PREFIX}gone")
    empty = temporary / f"{PREFIX}empty"
    empty.mkdir(0o700)
    os.utime(empty, (0.0, 0.0))
    async with bench.server.serving() as path:
        assert inside(temporary) == [path.parent]
        assert not gone.exists()
        os.utime(path.parent, (0.0, 0.0))
        remove_left_directories()
        assert path.exists(), "ours is locked"
    assert inside(temporary) == []


def test_directories_in_use_or_of_others_stay(temporary: Path, tmp_path: Path) -> None:
    young = left(temporary / f"{PREFIX}young", age_s=1.0)
    open_to_others = left(temporary / f"{PREFIX}others")
    open_to_others.chmod(0o755)
    with_more = left(temporary / f"{PREFIX}more")
    (with_more / "recording").touch()
    os.utime(with_more, (0.0, 0.0))
    foreign = left(temporary / "page-of-somebody")
    (temporary / f"{PREFIX}link").symlink_to(foreign)
    served = left(temporary / f"{PREFIX}served")
    (served / NAME).unlink()
    with socket.socket(socket.AF_UNIX) as alive:  # of a release that did not lock
        alive.bind(str(served / NAME))
        alive.listen()
        os.utime(served, (0.0, 0.0))
        before = sorted(temporary.rglob("*"))
        remove_left_directories()
        assert sorted(temporary.rglob("*")) == before
    assert young.exists()


def test_a_directory_is_locked_as_long_as_its_process_lives(temporary: Path) -> None:
    script = (
        "import sys, tempfile; tempfile.tempdir = sys.argv[1]\n"
        "from servo_ctrl.telemetry.local_socket.place import new_private_directory\n"
        "with new_private_directory() as path:\n"
        "    print(path.parent, flush=True); sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, str(temporary)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        directory = Path(process.stdout.readline().strip())
        os.utime(directory, (0.0, 0.0))
        remove_left_directories()
        assert directory.is_dir()
        process.kill()
    assert directory.is_dir(), "nobody has tidied up"
    remove_left_directories()
    assert not directory.exists()
