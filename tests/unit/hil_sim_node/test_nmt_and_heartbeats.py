"""NMT states, boot-up, heartbeat producer and consumer, in simulated time."""

import canopen
import pytest
from in_process_nodes import DRIVE, ENABLE, SCALE, SHUTDOWN, SWITCH_ON, InProcessNodes, SdoDrive, counts

HEARTBEAT = 0x700 + DRIVE
EMCY = 0x80 + DRIVE
MASTER = 0x77F
PRE_OPERATIONAL, OPERATIONAL, STOPPED = 127, 5, 4


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def heartbeat_of(drive: SdoDrive) -> int:
    drive.nodes.frames.clear()
    drive.nodes.sync(10)
    return drive.nodes.take(HEARTBEAT)[-1][0]


def test_nodes_boot_up_in_order_of_their_ids() -> None:
    assert InProcessNodes().frames == [(0x700 + DRIVE, b"\0"), (0x700 + SCALE, b"\0")]


def test_heartbeat_shows_the_state_and_keeps_its_period(drive: SdoDrive) -> None:
    drive.set(0x1017, 10)
    drive.nodes.frames.clear()
    drive.nodes.sync(100)
    assert drive.nodes.take(HEARTBEAT) == [bytes((PRE_OPERATIONAL,))] * 10
    for command, shown in ((1, OPERATIONAL), (2, STOPPED), (128, PRE_OPERATIONAL), (1, OPERATIONAL)):
        drive.nodes.put(0, bytes((command, DRIVE)))
        assert heartbeat_of(drive) == shown


def test_heartbeat_runs_in_simulated_time_only(drive: SdoDrive) -> None:
    drive.set(0x1006, 4000)
    drive.set(0x1017, 10)
    drive.nodes.frames.clear()
    drive.nodes.sync(10)
    assert len(drive.nodes.take(HEARTBEAT)) == 4


def test_commands_for_other_nodes_are_not_obeyed(drive: SdoDrive) -> None:
    drive.set(0x1017, 10)
    drive.nodes.put(0, bytes((1, SCALE)))
    assert heartbeat_of(drive) == PRE_OPERATIONAL
    drive.nodes.put(0, b"\x01")
    drive.nodes.put(0, bytes((99, DRIVE)))
    assert heartbeat_of(drive) == PRE_OPERATIONAL


def test_reset_node_restores_all_values_and_boots(drive: SdoDrive) -> None:
    drive.set(0x1017, 10)
    drive.set(0x6081, 1234)
    drive.control(SHUTDOWN)
    drive.nodes.frames.clear()
    drive.nodes.put(0, bytes((129, DRIVE)))
    assert drive.nodes.frames == [(HEARTBEAT, b"\0")]
    assert (drive.get(0x1017), drive.get(0x6081), drive.state) == (0, 5242880, "switch on disabled")


def test_reset_communication_leaves_the_application_alone(drive: SdoDrive) -> None:
    drive.set(0x1017, 10)
    drive.set(0x6081, 1234)
    drive.nodes.put(0, bytes((130, DRIVE)))
    assert (drive.get(0x1017), drive.get(0x6081)) == (0, 1234)


def test_consumer_is_armed_by_the_first_heartbeat(drive: SdoDrive) -> None:
    drive.set(0x1016, 127 << 16 | 50, 1)
    drive.nodes.operational()
    drive.nodes.frames.clear()
    drive.nodes.sync(200)
    assert drive.nodes.take(EMCY) == []


def test_lost_master_stops_the_axis(drive: SdoDrive) -> None:
    drive.set(0x1016, 127 << 16 | 50, 1)
    drive.set(0x1017, 10)
    drive.nodes.operational()
    drive.set(0x60FF, counts(20))
    drive.enable(3)
    for _ in range(30):
        drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
        drive.nodes.sync(10)
    assert drive.true_velocity_mm_s == pytest.approx(20, abs=0.1)
    drive.nodes.frames.clear()
    drive.nodes.sync(39)  # 49 ms after the last heartbeat
    assert drive.nodes.take(EMCY) == []
    drive.nodes.sync()
    (frame,) = drive.nodes.take(EMCY)
    assert frame[:4] == b"\x30\x81\x11\x7f"  # 8130h, register generic + communication, node 127
    drive.nodes.sync(200)
    assert drive.state == "fault"
    assert drive.true_velocity_mm_s == pytest.approx(0, abs=0.2)
    assert drive.get(0x603F) == 0x8130
    assert heartbeat_of(drive) == PRE_OPERATIONAL


@pytest.mark.parametrize(("behaviour", "state"), [(0, PRE_OPERATIONAL), (1, OPERATIONAL), (2, STOPPED)])
def test_error_behaviour_1029_chooses_the_nmt_state(drive: SdoDrive, behaviour: int, state: int) -> None:
    drive.set(0x1029, behaviour, 1)
    drive.set(0x1016, 127 << 16 | 20, 1)
    drive.set(0x1017, 5)
    drive.nodes.operational()
    drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
    drive.nodes.sync(30)
    assert heartbeat_of(drive) == state


@pytest.mark.parametrize(
    ("option", "state"), [(0, "enabled"), (1, "fault"), (2, "switch on disabled"), (3, "switch on disabled")]
)
def test_abort_connection_option_code(drive: SdoDrive, option: int, state: str) -> None:
    drive.set(0x6007, option)
    drive.set(0x1029, 1, 1)
    drive.set(0x1016, 127 << 16 | 20, 1)
    drive.nodes.operational()
    drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
    drive.enable(3)
    drive.nodes.sync(60)
    assert drive.state == state


def test_register_clears_when_the_master_is_back_and_the_fault_reset(drive: SdoDrive) -> None:
    drive.set(0x1016, 127 << 16 | 20, 1)
    drive.nodes.operational()
    drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
    drive.nodes.sync(30)
    assert drive.get(0x1001) == 0x11
    drive.nodes.frames.clear()
    drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
    drive.nodes.sync()
    assert drive.nodes.take(EMCY) == [bytes(8)]
    assert drive.get(0x1001) == 0
    drive.control(0x80)
    for word in (SHUTDOWN, SWITCH_ON, ENABLE):
        drive.control(word)
    assert drive.state == "enabled"


def test_one_node_cannot_be_watched_twice(drive: SdoDrive) -> None:
    drive.set(0x1016, 127 << 16 | 20, 1)
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1016, 127 << 16 | 30, 2)
    assert refusal.value.code == 0x06040043
    drive.set(0x1016, 126 << 16 | 30, 2)


def test_nmt_stop_in_motion_is_a_lost_connection(drive: SdoDrive) -> None:
    drive.nodes.operational()
    drive.set(0x60FF, counts(20))
    drive.enable(3)
    drive.nodes.sync(50)
    drive.nodes.put(0, bytes((2, DRIVE)))
    drive.nodes.sync(200)
    drive.nodes.put(0, bytes((128, DRIVE)))
    assert drive.state == "fault"
    assert drive.true_velocity_mm_s == pytest.approx(0, abs=0.2)


def test_the_error_ends_when_every_lost_node_is_back(drive: SdoDrive) -> None:
    drive.set(0x1016, 127 << 16 | 20, 1)
    drive.set(0x1016, 126 << 16 | 20, 2)
    drive.nodes.operational()
    drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
    drive.nodes.put(MASTER - 1, bytes((OPERATIONAL,)))
    drive.nodes.sync(30)
    drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
    assert drive.get(0x1001) == 0x11
    drive.nodes.put(MASTER - 1, bytes((OPERATIONAL,)))
    assert drive.get(0x1001) == 0


def test_a_lost_node_that_is_watched_no_longer_is_no_error(drive: SdoDrive) -> None:
    drive.set(0x1016, 127 << 16 | 20, 1)
    drive.nodes.operational()
    drive.nodes.put(MASTER, bytes((OPERATIONAL,)))
    drive.nodes.sync(30)
    drive.set(0x1016, 0, 1)
    assert drive.get(0x1001) == 0
