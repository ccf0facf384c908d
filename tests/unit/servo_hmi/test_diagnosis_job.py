"""Diagnoses as a program of its own: one at a time, with progress, ended when asked."""

import asyncio
import json
import signal
import sys
from pathlib import Path

import pytest

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.diagnosis import diagnoses as page_diagnoses
from servo_ctrl.hmi.diagnosis.diagnoses import Diagnoses, installed_command
from servo_ctrl.hmi.shell import program_jobs, program_process
from servo_ctrl.hmi.shell.program_jobs import Job, JobState
from servo_ctrl.hmi.shell.program_process import JobError

ADA, BOB = (Requester(user=user, role="operate", address="192.0.2.7") for user in ("ada", "bob"))
MODEL = "[axis.x.table]\nmass_kg = 50.0\n[axis.y.motor]\ntorque_constant_nm_a = 0.4\n"
SAY = "import sys, time, signal\ndef say(text): print(text, flush=True)\n"
OUT = "out = __import__('pathlib').Path(sys.argv[sys.argv.index('--out') + 1])\n"


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    recording, model = tmp_path / "run", tmp_path / "plant.toml"
    recording.mkdir()
    model.write_text(MODEL)
    return recording, model


@pytest.fixture(autouse=True)
def _command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    command = (sys.executable, str(tmp_path / "program.py"))
    monkeypatch.setattr(page_diagnoses, "installed_command", lambda: command)


def diagnoses(tmp_path: Path, program: str) -> Diagnoses:
    (tmp_path / "program.py").write_text(SAY + program)
    return Diagnoses(tmp_path / "jobs")


async def until(job: Job, *states: JobState) -> None:
    async with asyncio.timeout(20.0):
        while job.state not in states:  # noqa: ASYNC110  # a job has no event: pages poll it too
            await asyncio.sleep(0.01)


async def until_printed(job: Job, text: str) -> None:
    async with asyncio.timeout(20.0):
        while text not in job.lines:  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def test_a_diagnosis_gets_its_files_and_a_directory_of_its_own(
    tmp_path: Path, files: tuple[Path, Path]
) -> None:
    run = diagnoses(tmp_path, OUT + "(out / 'seen').write_text('\\n'.join(sys.argv[1:]))\n")
    job = await run.start([files[0]], files[1], ADA)
    await until(job, *program_jobs.ENDED)
    assert (job.state, job.progress, job.who) == (JobState.DONE, 1.0, "ada")
    given = (job.directory / "seen").read_text().splitlines()
    assert given == [str(files[0]), "--model", str(files[1]), "--out", str(job.directory)]
    assert job.directory.stat().st_mode & 0o077 == 0
    assert run.running is None
    assert run.job(job.key) is job
    assert run.job("\N{LATIN SMALL LETTER E WITH ACUTE}") is None


def step(name: str, done: object, of: object = 4, number: object = 1) -> str:
    return json.dumps({"format": number, "step": name, "done": done, "of": of})


async def test_its_steps_are_its_progress(tmp_path: Path, files: tuple[Path, Path]) -> None:
    lines = [step("reading", 0), step("axis x: force", 3)]
    run = diagnoses(tmp_path, f"for text in {lines!r}: say(text)\nsay('noise'); sys.exit(3)\n")
    job = await run.start([files[0]], files[1], ADA)
    await until(job, JobState.FAILED)
    assert (job.step, job.progress) == ("axis x: force", 0.75)
    assert job.lines == ["reading", "axis x: force", "noise"]
    assert job.reason == "it ended with 3: noise"


@pytest.mark.parametrize(
    "line",
    [
        "axis x: force",
        step("x", 1, number=2),
        step("x", -1),
        step("x", 1, 0),
        step("x", True),
        step("x" * 300, 1),
        "[" * 3000,
        "null",
    ],
)
async def test_a_line_that_is_no_step_is_kept_as_output(
    tmp_path: Path, files: tuple[Path, Path], line: str
) -> None:
    run = diagnoses(tmp_path, f"say({step('reading', 1)!r}); say({line!r})\n")
    job = await run.start([files[0]], files[1], ADA)
    await until(job, JobState.DONE)
    assert (job.step, job.lines) == ("reading", ["reading", line[: program_process.MAX_LINE_LENGTH]])


async def test_only_one_runs_and_it_ends_at_an_interrupt(tmp_path: Path, files: tuple[Path, Path]) -> None:
    run = diagnoses(
        tmp_path, "say('reading')\ntry: time.sleep(60)\nexcept KeyboardInterrupt: sys.exit(130)\n"
    )
    job = await run.start([files[0]], files[1], ADA)
    await until_printed(job, "reading")
    with pytest.raises(JobError, match="running already"):
        await run.start([files[0]], files[1], BOB)
    await run.cancel()
    assert job.state is JobState.CANCELLED
    assert job.ended is not None
    other = await run.start([files[0]], files[1], BOB)
    await run.cancel()
    assert run.jobs == [job, other]


async def test_a_program_that_ignores_the_interrupt_is_killed(
    tmp_path: Path, files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(program_jobs, "INTERRUPT_TIMEOUT_S", 0.05)
    deaf = "signal.signal(signal.SIGINT, signal.SIG_IGN)\nsay('reading')\ntime.sleep(60)\n"
    run = diagnoses(tmp_path, deaf)
    job = await run.start([files[0]], files[1], ADA)
    await until_printed(job, "reading")
    await asyncio.wait_for(run.cancel(), 10.0)
    assert job.state is JobState.CANCELLED


async def test_cancelling_without_a_job_does_nothing(tmp_path: Path) -> None:
    await diagnoses(tmp_path, "").cancel()


async def test_the_error_message_of_reconcile_is_the_reason(tmp_path: Path, files: tuple[Path, Path]) -> None:
    run = diagnoses(
        tmp_path, "say('reading'); say('reconcile: run1: no column time'); say('x' * 9); sys.exit(1)\n"
    )
    job = await run.start([files[0]], files[1], ADA)
    await until(job, JobState.FAILED)
    assert job.reason == "run1: no column time"


async def test_endless_output_is_bounded(tmp_path: Path, files: tuple[Path, Path]) -> None:
    run = diagnoses(tmp_path, "sys.stdout.write('x' * 3_000_000)\nfor k in range(2000): say(str(k))\n")
    job = await run.start([files[0]], files[1], ADA)
    await until(job, JobState.DONE)
    assert len(job.lines) <= program_jobs.MAX_LINES
    assert max(map(len, job.lines)) <= program_process.MAX_LINE_LENGTH
    assert job.lines[-1] == "1999"


async def test_invalid_files_are_refused_before_anything_starts(
    tmp_path: Path, files: tuple[Path, Path]
) -> None:
    run, (recording, model) = diagnoses(tmp_path, ""), files
    controller = tmp_path / "controller.toml"
    controller.write_text("[axis.x.control]\nkp = 1\n")
    for recordings, plant, reason in (
        ([], model, "at least one"),
        ([tmp_path / "nowhere"], model, "no such recording"),
        ([recording], tmp_path / "nowhere.toml", r"nowhere\.toml"),
        ([recording], controller, "is not a model"),
    ):
        with pytest.raises(ServoCtrlError, match=reason):
            await run.start(recordings, plant, ADA)
    assert run.jobs == []
    assert not run.directory.exists()


async def test_a_missing_program_is_reported(
    tmp_path: Path, files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_diagnoses, "installed_command", lambda: ("/nowhere/reconcile",))
    run = Diagnoses(tmp_path / "jobs")
    with pytest.raises(JobError, match="cannot be started"):
        await run.start([files[0]], files[1], ADA)


def test_the_installed_program_is_found_and_its_absence_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    program, *arguments = installed_command()
    assert Path(program).name == "reconcile"
    assert arguments[0] == "diagnose"
    monkeypatch.setattr(page_diagnoses, "PROGRAM", "not-installed-anywhere")
    with pytest.raises(JobError, match="not-installed-anywhere is not installed"):
        installed_command()


async def test_a_diagnosis_that_cannot_be_followed_ends(
    tmp_path: Path, files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_arguments: object) -> None:
        raise ZeroDivisionError("nobody expected that")

    monkeypatch.setattr(program_jobs, "_note_line", broken)
    run = diagnoses(tmp_path, "say('a line'); time.sleep(60)\n")
    job = await run.start([files[0]], files[1], ADA)
    await until(job, JobState.FAILED)
    assert "ZeroDivisionError: nobody expected that" in job.reason
    assert run.running is None
    assert run._process is not None
    assert run._process.returncode == -signal.SIGKILL, "it is waited for"
