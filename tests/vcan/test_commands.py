"""The controller on vcan0, commanded by can-utils: the dialogues of docs/commands.md typed by hand."""

import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from forked_program import commands_folder

pytestmark = [
    pytest.mark.vcan,
    pytest.mark.skipif(
        shutil.which("cansend") is None or shutil.which("candump") is None, reason="can-utils are missing"
    ),
]

BUS = "socketcan:vcan0"
OPTIONS = ("--machine", "machines/xy_table", "--bus", BUS)
LIMIT_S = 600.0
READY = "1FF#02"
ABORT_LEARNING = "67F#2F00210002000000"
ABORTED = "1FF#0205"


class Log:
    """`candump -L` of the controller's answers, status PDOs and errors, read as it grows."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def frames(self) -> list[str]:
        """As IDENTIFIER#DATA, in order of the bus."""
        return re.findall(r"vcan0 (\S+)", self._path.read_text(encoding="ascii"))

    def wait_for(self, beginning: str, after: int = 0) -> int:
        """Until a frame begins like this; how many there are then."""
        deadline_s = time.monotonic() + LIMIT_S
        while not any(frame.startswith(beginning) for frame in self.frames()[after:]):
            assert time.monotonic() < deadline_s, f"no {beginning} in {self.frames()[-10:]}"
            time.sleep(0.1)
        return len(self.frames())


@pytest.fixture(scope="module")
def log(
    tmp_path_factory: pytest.TempPathFactory,
    start: Callable[..., object],
    start_simulator: Callable[[str], object],
) -> Iterator[Log]:
    """Of a controller that is ready."""
    path = tmp_path_factory.mktemp("log") / "candump.log"
    filters = "vcan0,5FF:7FF,1FF:7FF,0FF:7FF"
    with path.open("wb") as file, subprocess.Popen(["candump", "-L", filters], stdout=file) as process:
        log = Log(path)
        start_simulator(BUS)
        start("servo-ctrl", "run", *OPTIONS, "--pacing", "lockstep", ready=": ")
        log.wait_for(READY)
        yield log
        process.terminate()


def cansend(frame: str) -> None:
    subprocess.run(["cansend", "vcan0", frame], check=True, timeout=60.0)


@pytest.mark.usefixtures("log")
def test_ask_reads_the_status_over_socketcan() -> None:
    done = subprocess.run(
        [commands_folder() / "servo-ctrl", "ask", *OPTIONS, "status"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
        timeout=LIMIT_S,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("ready, ")
    assert "learning: idle" in done.stdout


def test_learning_is_started_and_aborted_frame_by_frame(log: Log) -> None:
    for request, answer in (
        ("67F#2F002100FF000000", "5FF#8000210030000906"),  # there is no command 255
        ("67F#2F01210002000000", "5FF#6001210000000000"),  # axis 2
        ("67F#2F00210001000000", "5FF#6000210000000000"),  # start learning
        ("67F#2F00210001000000", "5FF#8000210022000008"),  # not twice
    ):
        before = len(log.frames())
        cansend(request)
        log.wait_for("5FF#", before)
        assert [frame for frame in log.frames()[before:] if frame.startswith("5FF")] == [answer]
    log.wait_for("1FF#03010002")  # running, learning, not due, axis 2
    cansend(ABORT_LEARNING)
    log.wait_for(ABORTED)
    assert not any(frame.startswith("0FF") for frame in log.frames())  # no EMCY
