"""Heartbeats counted in cycles, and emergency messages as text."""

import pytest

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.watch import HeartbeatWatch, describe_emcy, emcy_handler

OPERATIONAL, PRE_OPERATIONAL, BOOT_UP = b"\x05", b"\x7f", b"\x00"


def complaints(plans: tuple[NodePlan, ...], beats: dict[int, bytes], until: int) -> list[tuple[int, str]]:
    """(cycle, complaint) of the first node, with heartbeats every 100 cycles; `beats`: cycle -> payload."""
    found: list[tuple[int, str]] = []
    watch = HeartbeatWatch(plans[:1], 100, lambda text: found.append((watch.cycle, text)))
    hear = watch.handler(0)
    for cycle in range(until):
        found += [(cycle, text) for text in watch.advance(cycle)]
        if cycle in beats:
            hear(bytearray(beats[cycle]), 0.0)
    return found


def test_regular_heartbeats_are_fine(plans: tuple[NodePlan, ...]) -> None:
    assert complaints(plans, dict.fromkeys(range(50, 2000, 100), OPERATIONAL), 2000) == []


def test_silence_is_noticed_after_three_missed_heartbeats(plans: tuple[NodePlan, ...]) -> None:
    found = complaints(plans, {50: OPERATIONAL, 150: OPERATIONAL}, 2000)
    cycle, text = found[0]
    assert 150 + 300 < cycle <= 150 + 300 + 100
    assert text.startswith("axis.x.drive (node 1): no heartbeat in ")


def test_node_that_never_speaks_is_noticed(plans: tuple[NodePlan, ...]) -> None:
    assert complaints(plans, {}, 500)[0][0] <= 400


def test_node_that_leaves_operational_is_noticed(plans: tuple[NodePlan, ...]) -> None:
    found = complaints(plans, {50: OPERATIONAL, 150: OPERATIONAL, 250: PRE_OPERATIONAL}, 400)
    assert found == [(300, "axis.x.drive (node 1): has left NMT operational")]


def test_restart_is_reported_at_once(plans: tuple[NodePlan, ...]) -> None:
    found = complaints(plans, {50: OPERATIONAL, 210: BOOT_UP, 215: OPERATIONAL}, 290)
    assert found == [(210, "axis.x.drive (node 1): has restarted, its configuration is gone")]


def test_without_heartbeats_only_a_restart_is_detected(plans: tuple[NodePlan, ...]) -> None:
    found: list[str] = []
    watch = HeartbeatWatch(plans[:1], 0, found.append)
    assert [watch.advance(cycle) for cycle in range(2000)] == [[]] * 2000
    watch.handler(0)(bytearray(BOOT_UP), 0.0)
    assert len(found) == 1


def test_initial_state_of_a_node_is_no_error(plans: tuple[NodePlan, ...]) -> None:
    assert complaints(plans, {0: PRE_OPERATIONAL, 90: OPERATIONAL, 190: OPERATIONAL}, 290) == []


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0x8611, "following error"),
        (0x2310, "continuous over-current"),
        (0x2345, "current"),
        (0xFF10, "manufacturer specific"),
    ],
)
def test_emergency_codes_in_words(code: int, text: str) -> None:
    assert describe_emcy(code) == text


def test_emergency_names_node_code_and_register(plans: tuple[NodePlan, ...]) -> None:
    events: list[str] = []
    handle = emcy_handler(plans[0], events.append)
    handle(bytearray.fromhex("1186 21 0000000000"), 0.0)
    assert events == ["axis.x.drive (node 1): EMCY 8611h, following error (error register 21h)"]


def test_error_reset_is_no_event(plans: tuple[NodePlan, ...]) -> None:
    events: list[str] = []
    emcy_handler(plans[0], events.append)(bytearray(8), 0.0)
    assert events == []


def test_silence_is_reported_once_until_the_node_responds_again(plans: tuple[NodePlan, ...]) -> None:
    spoken = {50: OPERATIONAL, 1550: OPERATIONAL}
    cycles = [cycle for cycle, _ in complaints(plans, spoken, 3000)]
    assert cycles == [400, 1900]


def test_node_that_left_operational_may_be_started_again_but_not_one_that_restarted(
    plans: tuple[NodePlan, ...],
) -> None:
    watch = HeartbeatWatch(plans[:2], 100, lambda _text: None)
    first, second = watch.handler(0), watch.handler(1)
    assert (watch.left_operational(), watch.silence(0)) == ([], "")
    first(bytearray(PRE_OPERATIONAL), 0.0)
    assert (watch.left_operational(), watch.silence(0)) == ([0], "")
    first(bytearray(OPERATIONAL), 0.0)
    assert watch.left_operational() == []
    second(bytearray(BOOT_UP), 0.0)
    second(bytearray(OPERATIONAL), 0.0)
    assert [watch.restarted(node) for node in (0, 1)] == [False, True]
    watch.advance(1000)
    assert watch.silence(0) == "no heartbeat in 1000 cycles"
