"""A tuning of the machine that a controller is in charge of, which makes the motions over the bus."""

import asyncio
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
import tuning_client
from forked_program import commands_folder
from operated_table import ANNA, Operated, operated
from simulated_table import LONG_CYCLE

from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.run.client_watch import LOCKSTEP_SILENCE_S
from servo_ctrl.excitation.measuring_motion import LARGEST_FORCE_SHARE
from servo_ctrl.hmi.link.machine_link import MachineLink
from servo_ctrl.hmi.tuning.tunings import read_curves, read_figures
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.tuning.trial import evaluate

LIMIT_S = 600.0
STOPPED_CYCLES = 5000
"""Of some 17,000 that the travels there and back would take; a status is up to 0.1 s old."""


async def tune(table: Operated, out: Path) -> tuple[int | None, str]:
    """Exit status and output of the program, in a process of its own."""
    program = await asyncio.create_subprocess_exec(
        *(commands_folder() / "servo-ctrl", "tune", "--machine", table.machine, "--axis", "x"),
        *("--controller", table.socket, "--who", ANNA.model_dump_json()),
        *("--out", out, "--progress", "json"),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    async with asyncio.timeout(LIMIT_S):
        output, _ = await program.communicate()
    return program.returncode, output.decode()


async def test_a_file_that_the_controller_was_not_started_with_moves_nothing(
    bench: Any, tmp_path: Path
) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True) as table:
        await is_ready(table)
        file = table.machine / "controller.toml"
        file.write_text(file.read_text(encoding="utf-8") + "# changed since\n", encoding="utf-8")
        status, output = await tune(table, tmp_path / "out")
        assert status == 1
        assert "controller.toml is not what the controller was started with" in output
        assert not any("tuning run" in event.text for event in table.link.status.events)
        assert table.link.status.stage is Stage.READY
        await table.stop()


async def is_ready(table: Operated) -> None:
    await table.until(lambda status: status.stage is Stage.READY)


def trial_request(machine: Path, **changes: Any) -> dict[str, Any]:
    """A trial with the machine file's own gains."""
    control = load_machine(machine).axes["x"].control.model_dump()
    return {"axis": "x", "trial": True, "control": control | changes.pop("control", {}), **changes}


async def test_a_tuning_is_proved_by_the_controller_whose_own_values_act_afterwards(
    bench: Any, tmp_path: Path
) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True) as table:
        await is_ready(table)
        status, output = await tune(table, tmp_path / "out")
        assert status == 0, output
        await is_ready(table)
        answer = await table.link.request(
            ANNA, "tuning_run", limit_s=LIMIT_S, tuning=trial_request(table.machine)
        )
        assert answer.accepted, answer.reason
        again = load_recording(Path(str(answer.value)))
        await table.stop()
    figures = read_figures(tmp_path / "out")
    assert figures.proved
    assert not figures.simulated
    assert figures.measured_ms <= 2.06
    assert read_curves(tmp_path / "out") is not None
    recordings = {one.name.split("-")[0]: one for one in (tmp_path / "out" / "recordings").iterdir()}
    assert set(recordings) == {"after", "before", "measure"}
    # the same motion with the same gains: neither the home nor the state of the axis was lost in between
    machine = load_machine(table.machine)
    first, _ = evaluate(machine, "x", load_recording(recordings["before"]).segment)
    last, _ = evaluate(machine, "x", again.segment)
    assert last.circle_rms_m == pytest.approx(first.circle_rms_m, rel=0.05)
    assert figures.after.circle_rms_m != pytest.approx(first.circle_rms_m, rel=0.1)


@pytest.mark.parametrize(
    ("command", "reason"), [("quick_stop", "quick stop by the operator"), ("abort_program", "it was aborted")]
)
async def test_a_stop_in_motion_ends_the_tuning(
    bench: Any, tmp_path: Path, command: str, reason: str
) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True, stand_by=True) as table:
        await table.until(lambda status: status.stage is Stage.STANDBY)
        await table.ask("command", command="enable")
        await is_ready(table)
        tuning = asyncio.create_task(tune(table, tmp_path / "out"))
        await table.until(lambda status: status.stage is Stage.RUNNING and status.program.step >= 2)
        assert (await table.ask("command", command=command)).accepted
        status, output = await tuning
        assert status == 1
        assert f"has ended early: {reason}" in output
        refused = "anna (configure, 192.0.2.7): tuning run x: refused: "
        await table.until(lambda status: any(refused in event.text for event in status.events))
        at_rest = Stage.STANDBY if command == "quick_stop" else Stage.READY
        await table.until(lambda status: status.stage is at_rest)


async def test_a_motion_whose_asker_is_lost_is_stopped_at_once(bench: Any, tmp_path: Path) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True) as table:
        await is_ready(table)
        asker = MachineLink(table.socket)
        connection = asyncio.create_task(asker.run())
        await table.until(lambda _status: asker.connected)
        travels = trial_request(table.machine, trial=False, periods=8, force_n=1.0)
        asked = asyncio.create_task(asker.request(ANNA, "tuning_run", limit_s=LIMIT_S, tuning=travels))
        await table.until(lambda status: status.stage is Stage.RUNNING and status.program.step >= 2)
        lost_at = table.link.status.cycles
        connection.cancel()  # as the kernel does for a program that is killed
        assert not (await asked).accepted
        await table.until(lambda status: status.stage is not Stage.RUNNING)
        assert table.link.status.stage is Stage.READY
        assert table.link.status.cycles - lost_at < STOPPED_CYCLES
        why = "the tuning run of axis x has ended early: the connection that asked for it was lost"
        await table.until(lambda status: any(why in event.text for event in status.events))
        # what acts again are the controller's own values, and it makes the next motion
        answer = await table.ask("tuning_run", limit_s=LIMIT_S, tuning=trial_request(table.machine))
        assert answer.accepted, answer.reason
        await table.stop()


async def test_a_motion_whose_asker_is_silent_is_stopped_after_a_bounded_time(
    bench: Any, tmp_path: Path
) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True) as table:
        await is_ready(table)
        travels = trial_request(table.machine, trial=False, periods=8, force_n=1.0)
        asked = asyncio.create_task(table.ask("tuning_run", limit_s=LIMIT_S, tuning=travels))
        await table.until(lambda status: status.stage is Stage.RUNNING)
        began_at = table.link.status.cycles
        answer = await asked  # the connection stays, and nothing is asked meanwhile
        why = f"was silent for {LOCKSTEP_SILENCE_S:g} s"
        assert why in answer.reason
        silent = round(LOCKSTEP_SILENCE_S / load_machine(table.machine).period_s)
        assert table.link.status.cycles - began_at < silent + STOPPED_CYCLES
        await table.until(lambda status: any(why in event.text for event in status.events))
        assert table.link.status.stage is Stage.READY
        await table.stop()


async def test_a_motion_whose_asker_is_stopped_by_a_signal_is_stopped_after_a_bounded_time(
    bench: Any, tmp_path: Path
) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True) as table:
        await is_ready(table)
        client = await asyncio.create_subprocess_exec(
            *(sys.executable, tuning_client.__file__, table.socket, table.machine, tmp_path / "out"),
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )
        try:
            await table.until(lambda status: status.stage is Stage.RUNNING and status.program.step >= 2)
            client.send_signal(signal.SIGSTOP)
            stopped_at = table.link.status.cycles
            await table.until(lambda status: status.stage is not Stage.RUNNING)
            why = f"was silent for {LOCKSTEP_SILENCE_S:g} s"  # its connection is still open
            await table.until(lambda status: any(why in event.text for event in status.events))
            silent = round(LOCKSTEP_SILENCE_S / load_machine(table.machine).period_s)
            assert table.link.status.cycles - stopped_at < silent + STOPPED_CYCLES
            assert table.link.status.stage is Stage.READY
        finally:
            if client.returncode is None:
                client.send_signal(signal.SIGCONT)
        async with asyncio.timeout(LIMIT_S):
            output, _ = await client.communicate()
        assert b"the controller has made no run" in output
        await table.stop()


async def test_a_compensation_that_is_switched_on_in_a_motion_acts_behind_it(
    bench: Any, tmp_path: Path
) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True) as table:
        await is_ready(table)
        asked = asyncio.create_task(
            table.ask("tuning_run", limit_s=LIMIT_S, tuning=trial_request(table.machine))
        )
        await table.until(lambda status: status.stage is Stage.RUNNING and status.program.step >= 1)
        assert (await table.ask("command", command="enable_observer", axis="x")).accepted
        await table.until(lambda status: status.axes[0].observer_enabled)
        assert [axis.compensation_suspended for axis in table.link.status.axes] == [True, False]
        answer = await asked
        assert answer.accepted, answer.reason
        recorded = load_recording(Path(str(answer.value)))
        assert not recorded.columns["x.disturbance_n"].any()
        await table.until(lambda status: not status.axes[0].compensation_suspended)
        await table.until(lambda _status: abs(table.link.rows.newest("x.disturbance_n")) > 0.0)
        await table.stop()


async def test_what_is_not_bounded_or_not_possible_now_is_refused(bench: Any, tmp_path: Path) -> None:
    async with operated(bench, tmp_path, None, LONG_CYCLE, serve=True) as table:
        await is_ready(table)
        machine = table.machine
        too_much_n = 1.01 * LARGEST_FORCE_SHARE * load_machine(machine).axes["x"].limits.force_n
        for refused, reason in (
            (trial_request(machine, periods=2, force_n=too_much_n), "a tuning adds at most"),
            (trial_request(machine, trial=False), "the tuning run has no motion"),
            (trial_request(machine, axis="z"), 'there is no axis "z"'),
            (trial_request(machine, control={"kp_1_s": -1.0}), "kp_1_s"),
            (trial_request(machine, control={"gain": 1.0}), "gain"),
            (trial_request(machine, notch={"enabled": True, "frequency_hz": 5000.0}), "frequency_hz"),
        ):
            answer = await table.ask("tuning_run", tuning=refused)
            assert not answer.accepted
            assert reason in answer.reason
        await table.ask("setting", setting="feed_override_percent", value=50.0)
        answer = await table.ask("tuning_run", tuning=trial_request(machine))
        assert "set both overrides to 100 %" in answer.reason
        await table.stop()
