"""An operated machine on simulated drives: power, faults, feed hold and jogging."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from operator_script import Operator, Script, at, operate
from program_steps import circle

from servo_ctrl.commands.command import JOG_RENEWAL_S, Command
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.cyclic.cia402 import DriveState, drive_state
from servo_ctrl.daemon.run import assemble

RADIUS_M = 0.010
PROGRAM = circle(10.0, 3000.0)
LIMIT_M_S2 = 2.0
RENEWAL = round(JOG_RENEWAL_S / 1e-3)
STANDBY = Stage.STANDBY


def states(columns: dict[str, np.ndarray], axis: str) -> list[DriveState]:
    return [drive_state(int(word)) for word in columns[f"{axis}.statusword"]]


async def test_program_is_held_on_the_circle_and_axes_are_jogged(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine_dir = bench.machine({})
    bench.simulate(machine_dir)
    path = tmp_path / "round.toml"
    path.write_text(PROGRAM, encoding="utf-8")
    program = load_program(path, load_machine(machine_dir))
    noted: dict[str, int] = {}

    def script(operator: Operator) -> Script:
        yield at(STANDBY)
        assert operator.handler.load_program(program).accepted
        assert operator.ask(Command.ENABLE) == ""
        yield at(Stage.READY)
        assert operator.ask(Command.START_PROGRAM) == ""
        yield 400
        assert operator.ask(Command.HOLD_PROGRAM) == ""
        yield 200
        noted["held"] = operator.cycle
        assert operator.status.program.held
        assert operator.ask(Command.RESUME_PROGRAM) == ""
        yield at(Stage.READY)
        noted["done"] = operator.cycle
        assert operator.status.program.progress == 1.0
        for _ in range(3):
            assert operator.handler.jog("x", 0.03).accepted
            assert operator.handler.jog("y", -0.02).accepted
            yield 150
        noted["last renewed"] = operator.cycle - 150
        yield at(Stage.READY)
        noted["still"] = operator.cycle
        assert operator.ask(Command.HOME) == ""
        yield at(Stage.READY)
        noted["homed"] = operator.cycle
        operator.end()

    operator = Operator(monkeypatch, script)
    report, columns = await operate(bench, machine_dir, tmp_path / "r", operator)
    assert (report.failed, report.signal) == (False, "SIGTERM")
    command = np.column_stack([columns["x.position_command_m"], columns["y.position_command_m"]])
    speed = np.column_stack([columns["x.velocity_command_m_s"], columns["y.velocity_command_m_s"]])
    commanded = np.isfinite(command).all(axis=1)
    begun = int(np.argmax(commanded))
    moved = slice(begun, noted["still"] + 1)
    assert np.abs(np.diff(speed[moved], axis=0) / 1e-3).max() <= LIMIT_M_S2 * (1.0 + 1e-6)
    # every point of the program is on the circle, the hold at standstill, the end where planned
    start = command[begun]
    ran = command[begun : noted["done"]]
    radius = np.hypot(ran[:, 0] - start[0] + RADIUS_M, ran[:, 1] - start[1])
    assert np.abs(radius - RADIUS_M).max() < 1e-12
    assert not speed[noted["held"] - 20 : noted["held"]].any()
    assert command[noted["done"]] == pytest.approx(start, abs=1e-12)
    # ramp from 0.03 m/s at 2 m/s^2, 15 cycles, after the renewal time of a jog
    stopped = np.flatnonzero(speed[: noted["still"] + 1, 0])[-1]
    assert stopped == pytest.approx(noted["last renewed"] + RENEWAL + 0.03 / LIMIT_M_S2 / 1e-3, abs=2)
    # homed where it stands: the new zero
    assert command[noted["homed"]] == pytest.approx([0.0, 0.0], abs=2e-5)
    assert np.nanmax(np.abs(columns["x.position_error_m"])) < 1e-4


ENABLE_FRAME = bytes.fromhex("2F0021000E000000")
QUICK_STOP_FRAME = bytes.fromhex("2F00210010000000")
HOLD_FRAME = bytes.fromhex("2F00210011000000")
ACCEPTED, WRONG_STATE = bytes.fromhex("6000210000000000"), bytes.fromhex("8000210022000008")
SDO_REQUEST, SDO_RESPONSE = 0x600 + 127, 0x580 + 127
CONSUMER_TIME = "23161001 {:02X}{:02X}7F00"
"""1016h:01 of a drive: its consumer time of the controller's heartbeat, ms."""
RESET_SCALE_Y = bytes((0x81, 12))


def sdo(monitor: Any, payload: bytes, wanted: bytes) -> Callable[[Operator], bool]:
    """Send a request to the controller; return the condition that it is answered."""
    before = len([can_id for can_id, _ in monitor.frames if can_id == SDO_RESPONSE])
    monitor.send(SDO_REQUEST, payload)

    def answered(_operator: Operator) -> bool:
        answers = [data for can_id, data in monitor.frames if can_id == SDO_RESPONSE]
        assert len(answers) == before or answers[-1] == wanted
        return len(answers) > before

    return answered


def stops(operator: Operator, monitor: Any, noted: dict[str, Any]) -> Script:
    """Enable by SDO, a quick stop while an axis is jogged, and one by SDO."""
    yield at(STANDBY)
    yield sdo(monitor, HOLD_FRAME, WRONG_STATE)
    yield sdo(monitor, ENABLE_FRAME, ACCEPTED)
    yield at(Stage.READY)
    operator.handler.jog("x", 0.05)
    yield 100
    assert operator.ask(Command.QUICK_STOP) == ""
    noted["stop"] = operator.cycle
    yield at(STANDBY)
    noted["standby"] = operator.status.reason
    stood_m = operator.status.drives[0].position_m
    operator.ask(Command.ENABLE)
    yield at(Stage.READY)
    assert operator.status.drives[0].position_m == pytest.approx(stood_m, abs=1e-4)
    yield sdo(monitor, QUICK_STOP_FRAME, ACCEPTED)
    yield at(STANDBY)


def faults(operator: Operator, monitor: Any, noted: dict[str, Any]) -> Script:
    """A drive that misses our heartbeat and returns, and a scale that restarts and does not."""
    operator.ask(Command.ENABLE)
    yield at(Stage.READY)
    monitor.send(0x602, bytes.fromhex(CONSUMER_TIME.format(1, 0)))
    yield at(STANDBY)
    yield 300
    noted["fault"] = operator.status
    monitor.send(0x602, bytes.fromhex(CONSUMER_TIME.format(0, 4)))
    yield lambda _operator: [can_id for can_id, _ in monitor.frames].count(0x582) >= 2
    noted["asked"] = operator.ask(Command.ENABLE)
    yield 300
    assert operator.ask(Command.ENABLE) == ""
    yield at(Stage.READY)
    noted["recovered"] = operator.status
    assert operator.ask(Command.DISABLE) == ""
    yield at(STANDBY)
    noted["off"] = operator.cycle
    monitor.send(0x000, RESET_SCALE_Y)
    yield 2
    yield lambda now: any("restarted" in text for text in now.machine.events.kept)
    assert operator.ask(Command.ENABLE) == ""
    assert operator.status.setting_up
    noted["twice"] = operator.ask(Command.ENABLE)
    assert operator.ask(Command.QUICK_STOP) == "", "calls the power off"
    yield lambda now: not now.status.setting_up
    assert operator.machine.stage is STANDBY
    yield 50
    assert operator.machine.stage is STANDBY
    noted["called off"] = operator.cycle
    assert operator.ask(Command.ENABLE) == ""
    yield at(Stage.READY)
    operator.end()


async def test_stops_and_faults_end_in_standby_and_enabling_begins_afresh(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the write to 1016h makes one drive miss the heartbeat; it is not the fault under test
    monkeypatch.setattr(assemble, "report_writes", lambda *_: None)
    machine_dir = bench.machine({})
    bench.simulate(machine_dir)
    noted: dict[str, Any] = {}
    with bench.monitor() as monitor:

        def script(operator: Operator) -> Script:
            yield from stops(operator, monitor, noted)
            yield from faults(operator, monitor, noted)

        operator = Operator(monkeypatch, script)
        report, columns = await operate(bench, machine_dir, tmp_path / "r", operator)
    ours = [data for can_id, data in monitor.frames if can_id == 0x0FF]
    # sent in the cycle after the command, active with the next SYNC
    for axis in ("x", "y"):
        after_stop = states(columns, axis)[noted["stop"] : noted["stop"] + 3]
        assert after_stop[0] is DriveState.OPERATION_ENABLED
        assert DriveState.OPERATION_ENABLED not in after_stop[2:], "a cycle after the command"
    assert noted["standby"] == "quick stop by the operator"
    fault: MachineStatus = noted["fault"]
    assert "axis.y.drive (node 2)" in fault.reason
    y = fault.drives[1]
    assert (y.phase, y.state, y.error_code, y.ready) == ("lost", "not responding", 0x8130, False)
    assert fault.drives[0].error_code is None
    assert noted["asked"].endswith("has left NMT operational and is started again; enable once more")
    recovered: MachineStatus = noted["recovered"]
    assert (recovered.reason, recovered.drives[1].error_code, recovered.drives[1].ready) == ("", None, True)
    assert ours == [bytes.fromhex("0010 01 0000000000"), bytes(8)], "an error, and that it is over"
    assert noted["twice"] == "axis.y.scale (node 12): is being configured again; wait for its end"
    power = {DriveState.OPERATION_ENABLED, DriveState.SWITCHED_ON}
    assert not power & set(states(columns, "x")[noted["off"] + 2 : noted["called off"]])
    assert (report.signal, report.completed) == ("SIGTERM", False)


@pytest.mark.usefixtures("hub")
async def test_a_simulator_killed_in_motion_and_started_again_is_enabled_from_standby(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine_dir = bench.machine({"input_timeout_ms = 2000": "input_timeout_ms = 300"})
    simulator = bench.simulate(machine_dir)
    noted: list[str] = []

    def script(operator: Operator) -> Script:
        yield at(STANDBY)
        operator.ask(Command.ENABLE)
        yield at(Stage.READY)
        operator.handler.jog("x", 0.05)
        yield 100
        simulator.kill()
        yield at(STANDBY)
        noted.append(operator.status.reason)
        bench.simulate(machine_dir)
        yield lambda now: sum("restarted" in text for text in now.machine.events.kept) == 4
        assert operator.ask(Command.ENABLE) == ""
        assert [drive.homed for drive in operator.status.drives] == [True, True]
        yield at(Stage.READY)
        assert [drive.homed for drive in operator.status.drives] == [True, True]
        noted.extend(operator.machine.events.kept)
        operator.handler.jog("x", 0.05)
        yield 100
        assert operator.status.drives[0].position_m > 0.001
        operator.end()

    operator = Operator(monkeypatch, script)
    report, _columns = await operate(bench, machine_dir, tmp_path / "r", operator)
    assert not report.failed
    assert noted[0].endswith("its TPDOs are no longer received")
    lost = "its drive was configured again and has lost its reference; it homes again"
    assert [axis in "".join(noted) for axis in (f"axis x: {lost}", f"axis y: {lost}")] == [True, True]
