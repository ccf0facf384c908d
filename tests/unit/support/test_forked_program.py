"""A forked program is as a user's, for tests and for the product that starts it: output, status, signals."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import can
import pytest
from forked_program import HIL_SIM, ForkedProgram, commands_folder, programs_forked

USER_COMMANDS = Path(sys.executable).parent
LIMIT_S = 300.0


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [str(folder / words[0]), *words[1:]], capture_output=True, timeout=LIMIT_S, check=False
    )


@pytest.mark.parametrize(
    "words",
    [
        ("servo-ctrl", "check", "--machine", "nowhere"),
        ("servo-ctrl", "no-command"),
        ("hil-sim", "--version"),
        ("python3", "-m", "servo_ctrl.hmi", "token", "--help"),
        ("python3", "-c", "import sys; sys.exit('of Python itself')"),
    ],
)
def test_output_and_status_are_those_of_the_command_of_a_user(words: tuple[str, ...]) -> None:
    forked, own = run(commands_folder(), *words), run(USER_COMMANDS, *words)
    assert (forked.returncode, forked.stdout, forked.stderr) == (own.returncode, own.stdout, own.stderr)


def simulator(folder: Path) -> list[str]:
    bus = f"localcan:{folder / 'can.sock'}"
    return [*HIL_SIM, "run", "--machine", "machines/xy_table", "--bus", bus, "--pacing", "lockstep"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_signal_to_the_command_ends_the_program(tmp_path: Path, number: signal.Signals) -> None:
    with programs_forked():
        program, *arguments = simulator(tmp_path)
        command = [str(Path(sys.executable).with_name(program)), *arguments]
        process = subprocess.Popen(command, stdout=subprocess.PIPE)
    assert process.stdout is not None
    while b"on the bus" not in process.stdout.readline():
        assert process.poll() is None
    can.Bus(interface="localcan", channel=str(tmp_path / "can.sock")).shutdown()
    process.send_signal(number)
    assert process.stdout.read() == b""  # its end: the program has the pipe, too
    assert process.wait(LIMIT_S) == (0 if number == signal.SIGTERM else -number)
    process.stdout.close()


def test_the_status_of_a_program_that_was_killed_is_the_signal(tmp_path: Path) -> None:
    process = ForkedProgram(simulator(tmp_path))
    assert process.poll() is None
    process.kill()
    assert process.wait(LIMIT_S) == -signal.SIGKILL
    with pytest.raises(ProcessLookupError):
        os.kill(process.pid, 0)
    assert process.stdout is not None
    process.stdout.close()
