"""The status TPDO: its contents, and the cycle in which it is sent. A cycle is 1 ms."""

import pytest
from controller_node_bench import NODE_ID, ControllerNodeBench
from fake_command_handler import REVERSAL

from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage

SILENT = 0x8000_0000


@pytest.fixture
def bench() -> ControllerNodeBench:
    made = ControllerNodeBench.booted()
    made.node.operational(running=True)
    assert made.cycles(1) == [1]  # an operational node begins by saying where it is
    made.frames.clear()
    return made


def set_up(bench: ControllerNodeBench, *, kind: int = 255, inhibit: int = 0, timer_ms: int = 0) -> None:
    entry = bench.remote.sdo[0x1800]
    entry[2].raw, entry[3].raw, entry[5].raw = kind, inhibit, timer_ms
    bench.frames.clear()


def sent_in(bench: ControllerNodeBench, cycles: int) -> list[int]:
    """Numbers of the cycles in which it was sent, from 1 on."""
    return [number for number, count in enumerate(bench.cycles(cycles), 1) if count]


def test_it_is_sent_every_100_ms_by_default(bench: ControllerNodeBench) -> None:
    assert sent_in(bench, 350) == [100, 200, 300]


def test_missed_cycles_are_time_too(bench: ControllerNodeBench) -> None:
    assert bench.cycles(10, elapsed=25) == [0, 0, 0, 1, 0, 0, 0, 1, 0, 0]


def test_a_change_is_sent_with_the_next_cycle_and_restarts_the_timer(bench: ControllerNodeBench) -> None:
    assert sent_in(bench, 30) == []
    bench.node.announce()
    bench.node.announce()
    assert sent_in(bench, 101) == [1, 101]


def test_without_a_timer_only_changes_are_sent(bench: ControllerNodeBench) -> None:
    set_up(bench, timer_ms=0)
    assert sent_in(bench, 1000) == []
    bench.node.announce()
    assert sent_in(bench, 1000) == [1]


@pytest.mark.parametrize("kind", [254, 255])
def test_changes_wait_for_the_inhibit_time(bench: ControllerNodeBench, kind: int) -> None:
    set_up(bench, kind=kind, inhibit=50)  # 5 ms
    numbers = []
    for number in range(1, 13):
        bench.node.announce()
        numbers += [number] * sum(bench.cycles(1))
    assert numbers == [5, 10]


@pytest.mark.parametrize("every", [1, 7, 240])
def test_synchronous_types_count_syncs(bench: ControllerNodeBench, every: int) -> None:
    set_up(bench, kind=every, timer_ms=100)
    bench.node.announce()
    assert sent_in(bench, 3 * every) == [every, 2 * every, 3 * every]


def test_a_sync_that_was_missed_is_not_counted(bench: ControllerNodeBench) -> None:
    set_up(bench, kind=2)
    assert bench.cycles(4, elapsed=10) == [0, 1, 0, 1]


def test_type_0_sends_changes_at_the_next_sync(bench: ControllerNodeBench) -> None:
    set_up(bench, kind=0, timer_ms=10)
    assert sent_in(bench, 100) == []
    bench.node.announce()
    assert sent_in(bench, 100) == [1]


def test_bit_31_of_the_cob_id_switches_it_off_and_on(bench: ControllerNodeBench) -> None:
    cob_id = bench.remote.sdo[0x1800][1]
    assert cob_id.raw == 0x4000_0180 + NODE_ID
    cob_id.raw |= SILENT
    bench.node.announce()
    assert sent_in(bench, 300) == []
    cob_id.raw &= ~SILENT
    assert sent_in(bench, 300) == [1, 101, 201]


def test_it_is_sent_in_operational_only_and_the_last_change_is_still_sent(bench: ControllerNodeBench) -> None:
    bench.handler.now = bench.handler.now._replace(stage=Stage.OFF)
    bench.node.announce()
    bench.node.operational(running=False)
    assert [payload[0] for payload in bench.status_pdos] == [7]
    bench.node.announce()
    assert sent_in(bench, 300) == []


def test_bytes_of_a_learning_run_with_the_first_axis_due(bench: ControllerNodeBench) -> None:
    bench.handler.set_learning("y", LearningState.RUNNING)
    bench.handler.set_axis(0, learning_due=True, last=REVERSAL)
    bench.node.announce()
    bench.cycles(1)
    # ready, running, axis x due, axis y learns, 250 per mille = FAh, 2.4 um = 24 tenths
    assert bench.status_pdos == [bytes.fromhex("02 01 01 02 fa00 1800")]


def test_canopens_client_decodes_it_by_the_mapping_of_the_eds(bench: ControllerNodeBench) -> None:
    bench.handler.set_learning("x", LearningState.PAUSED)
    bench.handler.set_axis(1, learning_due=True, last=REVERSAL._replace(error_mean_m=1.0))
    pdo = bench.remote.tpdo[1]
    pdo.read()
    pdo.subscribe()
    bench.node.announce()
    bench.cycles(1)
    assert [variable.raw for variable in pdo] == [2, 3, 2, 1, 250, 0xFFFE]
    assert [variable.name.split(".")[-1] for variable in pdo] == [
        "Controller state",
        "Learning state",
        "Learning due bit mask",
        "Axis being learned",
        "Progress in per mille",
        "J of that axis in tenths of um",
    ]


def test_before_the_first_reversal_there_is_no_j(bench: ControllerNodeBench) -> None:
    bench.node.announce()
    bench.cycles(1)
    assert bench.status_pdos == [bytes.fromhex("02 00 00 00 0000 ffff")]


def test_the_axis_that_reversed_last_gives_its_j(bench: ControllerNodeBench) -> None:
    bench.handler.set_axis(0, last=REVERSAL)
    bench.handler.set_axis(1, last=REVERSAL._replace(cycle=REVERSAL.cycle + 1, error_mean_m=9.96e-6))
    assert bench.remote.sdo[0x2113][2].raw == 2
    assert bench.remote.sdo[0x2113][3].raw == 100


def test_a_run_that_is_done_shows_1000(bench: ControllerNodeBench) -> None:
    bench.handler.set_learning("x", LearningState.DONE)
    assert bench.remote.sdo[0x2110][7].raw == 1000
