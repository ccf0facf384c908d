"""The controller's node: boot-up, heartbeat, NMT, identity and errors, read by canopen's client."""

import shutil
from pathlib import Path

import canopen
import pytest
from cia306 import findings
from controller_node_bench import NODE_ID, OWN_EDS, ControllerNodeBench

from servo_ctrl.canopen.node import load_own_eds
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ConfigError

HEARTBEAT_ID = 0x700 + NODE_ID


@pytest.fixture
def bench() -> ControllerNodeBench:
    made = ControllerNodeBench.booted()
    made.frames.clear()
    return made


def heartbeats(bench: ControllerNodeBench) -> list[bytes]:
    return [payload for can_id, payload in bench.frames if can_id == HEARTBEAT_ID]


def test_eds_is_clean_under_cia_306() -> None:
    assert findings(OWN_EDS) == []


def test_eds_without_the_commands_is_refused(table: MachineConfig, tmp_path: Path) -> None:
    old = tmp_path / "servo_ctrl.eds"
    shutil.copy(OWN_EDS, old)
    old.write_text(old.read_text(encoding="ascii").replace("[2100]", "[20FF]"), encoding="ascii")
    machine = table.model_copy(update={"controller": table.controller.model_copy(update={"eds": old})})
    with pytest.raises(ConfigError, match=r"controller\.eds: .*servo_ctrl\.eds: object 2100h is missing"):
        load_own_eds(machine)


def test_identity_is_that_of_the_eds(bench: ControllerNodeBench) -> None:
    sdo = bench.remote.sdo
    asked = [sdo[0x1000].raw, *(sdo[0x1018][sub].raw for sub in (1, 2, 3))]
    assert asked == [0, 0xFFFE, 0x53435452, 0x0002_0000]
    assert sdo[0x1018][4].raw != 0
    assert sdo[0x1008].raw == "servo_ctrl"
    assert (sdo[0x1014].raw, sdo[0x1200][1].raw) == (0x80 + 127, 0x600 + 127)
    assert (sdo[0x1005].raw, sdo[0x1006].raw) == (0x4000_0080, 1000)


def test_boot_up_then_heartbeats_with_the_nmt_state() -> None:
    bench = ControllerNodeBench()
    bench.node.boot_up()
    bench.node.send_heartbeat()
    bench.node.operational(running=True)
    bench.node.send_heartbeat()
    assert bench.frames == [(0x77F, b"\x00"), (0x77F, b"\x7f"), (0x77F, b"\x05")]


def test_a_controller_that_has_not_booted_is_silent() -> None:
    bench = ControllerNodeBench()
    bench.node.send_heartbeat()
    assert bench.node.heartbeat_s == 0.0
    assert bench.ask("40 0010 00 00000000") == []
    bench.put(0x000, bytes((129, 0)))
    assert bench.frames == []


def test_heartbeat_is_counted_in_cycles(bench: ControllerNodeBench) -> None:
    bench.cycles(1000)
    assert len(heartbeats(bench)) == 10


def test_missed_cycles_count_for_the_heartbeat_too(bench: ControllerNodeBench) -> None:
    bench.cycles(100, elapsed=10)
    assert len(heartbeats(bench)) == 10


def test_client_changes_the_heartbeat_by_1017(bench: ControllerNodeBench) -> None:
    bench.remote.sdo[0x1017].raw = 20
    assert bench.remote.sdo[0x1017].raw == 20
    bench.frames.clear()
    bench.cycles(100)
    assert len(heartbeats(bench)) == 5
    bench.remote.sdo[0x1017].raw = 0
    bench.frames.clear()
    bench.cycles(2000)
    assert heartbeats(bench) == []


def test_state_and_counters_are_live(bench: ControllerNodeBench) -> None:
    bench.handler.now = bench.handler.now._replace(
        stage=Stage.RUNNING, cycles=(1 << 32) + 70_000, missed_ticks=12
    )
    assert [bench.remote.sdo[index].raw for index in (0x2000, 0x2002, 0x2003)] == [3, 70_000, 12]


def test_errors_reach_register_history_text_and_emcy(bench: ControllerNodeBench) -> None:
    bench.node.report_error(0x8130, "axis.x.drive (node 1): no heartbeat")
    bench.node.report_error(0x8611, "axis x: following error")
    emcy = [payload for can_id, payload in bench.frames if can_id == 0x80 + 127]
    assert emcy == [bytes.fromhex("3081 01 0000000000"), bytes.fromhex("1186 01 0000000000")]
    assert bench.remote.sdo[0x1001].raw == 1
    history = bench.remote.sdo[0x1003]
    assert [history[sub].raw for sub in range(4)] == [2, 0x8611, 0x8130, 0]
    assert bench.remote.sdo[0x2001].raw == "axis x: following error"


def test_cleared_error_is_reported_and_stays_in_the_history(bench: ControllerNodeBench) -> None:
    bench.node.report_error(0x8611, "axis x: following error")
    bench.node.clear_error()
    assert [payload for can_id, payload in bench.frames if can_id == 0x80 + 127][-1] == bytes(8)
    assert bench.remote.sdo[0x1001].raw == 0
    assert [bench.remote.sdo[0x1003][sub].raw for sub in (0, 1)] == [1, 0x8611]


def test_the_stop_reason_is_readable(bench: ControllerNodeBench) -> None:
    bench.handler.now = bench.handler.now._replace(
        stage=Stage.STANDBY, reason="axis y: the drive is in fault"
    )
    assert bench.remote.sdo[0x2000].raw == 8
    assert bench.remote.sdo[0x2004].raw == "axis y: the drive is in fault"


def test_another_node_is_commanded_to_operational(bench: ControllerNodeBench) -> None:
    bench.node.start(12)
    assert bench.frames[-1] == (0x000, b"\x01\x0c")


def test_writing_zero_clears_the_history_and_nothing_else_can_be_written(bench: ControllerNodeBench) -> None:
    bench.node.report_error(0x8130, "axis.x.drive (node 1): no heartbeat")
    with pytest.raises(canopen.SdoAbortedError, match="0x06090030"):
        bench.remote.sdo[0x1003][0].raw = 1
    bench.remote.sdo[0x1003][0].raw = 0
    assert [bench.remote.sdo[0x1003][sub].raw for sub in (0, 1)] == [0, 0]


def test_consumed_heartbeats_are_listed(bench: ControllerNodeBench) -> None:
    consumers = bench.remote.sdo[0x1016]
    assert [consumers[sub].raw for sub in range(6)] == [8, *(node << 16 | 300 for node in (1, 2, 11, 12)), 0]


@pytest.mark.parametrize(
    ("command", "state"), [(b"\x01\x7f", 5), (b"\x02\x00", 4), (b"\x80\x7f", 127), (b"\x01\x7e", 127)]
)
def test_nmt_commands_of_others_change_the_controller_node_only(
    bench: ControllerNodeBench, command: bytes, state: int
) -> None:
    bench.put(0x000, command)
    bench.node.send_heartbeat()
    assert bench.frames == [(HEARTBEAT_ID, bytes((state,)))]
    assert bench.handler.requests == []


def test_a_stopped_node_answers_no_sdo_until_it_is_started(bench: ControllerNodeBench) -> None:
    bench.put(0x000, b"\x02\x7f")
    assert bench.ask("40 0010 00 00000000") == []
    bench.put(0x000, b"\x01\x7f")
    assert bench.ask("40 0010 00 00000000") == ["4300100000000000"]


@pytest.mark.parametrize("command", [b"\x81\x7f", b"\x82\x00"])
def test_a_reset_boots_up_with_the_settings_of_power_on(bench: ControllerNodeBench, command: bytes) -> None:
    bench.remote.sdo[0x1017].raw = 20
    bench.remote.sdo[0x1800][2].raw = 1
    bench.frames.clear()
    bench.put(0x000, command)
    assert bench.frames == [(HEARTBEAT_ID, b"\x00")]
    assert (bench.remote.sdo[0x1017].raw, bench.remote.sdo[0x1800][2].raw) == (100, 255)


@pytest.mark.parametrize("payload", [b"", b"\x81", b"\x81\x7f\x00", b"\x03\x7f"])
def test_an_invalid_nmt_command_changes_nothing(bench: ControllerNodeBench, payload: bytes) -> None:
    bench.put(0x000, payload)
    bench.node.send_heartbeat()
    assert bench.frames == [(HEARTBEAT_ID, b"\x7f")]
