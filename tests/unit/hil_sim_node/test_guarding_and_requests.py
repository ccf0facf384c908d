"""Node guarding, remote frames for TPDOs, consumed emergencies, verify configuration, manufacturer status."""

import canopen
import pytest
from in_process_nodes import DRIVE, SCALE, InProcessNodes, SdoDrive, counts

GUARD = 0x700 + DRIVE
EMCY, SCALE_EMCY = 0x80 + DRIVE, 0x80 + SCALE
TPDO = 0x180 + DRIVE
OFF, NOT_ON_REQUEST = 0x8000_0000, 0x4000_0000
PRE_OPERATIONAL, OPERATIONAL, STOPPED = 127, 5, 4


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def answers_to(drive: SdoDrive, can_id: int) -> list[bytes]:
    drive.nodes.frames.clear()
    drive.nodes.ask(can_id)
    return drive.nodes.take(can_id)


def test_guarding_shows_the_state_under_a_toggle_bit(drive: SdoDrive) -> None:
    assert [answers_to(drive, GUARD) for _ in range(3)] == [[b"\x7f"], [b"\xff"], [b"\x7f"]]
    drive.nodes.operational()
    assert answers_to(drive, GUARD) == [bytes((0x80 | OPERATIONAL,))]
    drive.nodes.put(0, bytes((2, DRIVE)))
    assert answers_to(drive, GUARD) == [bytes((STOPPED,))]
    drive.nodes.put(0, bytes((130, DRIVE)))
    assert answers_to(drive, GUARD) == [bytes((PRE_OPERATIONAL,))]  # a reset begins with 0


def test_a_node_with_a_heartbeat_is_not_guarded(drive: SdoDrive) -> None:
    drive.set(0x1017, 10)
    assert answers_to(drive, GUARD) == []


def test_a_master_that_ceases_to_guard_is_lost(drive: SdoDrive) -> None:
    drive.set(0x100C, 20)
    drive.set(0x100D, 3)
    drive.nodes.operational()
    drive.enable(3)
    drive.nodes.sync(100)
    assert drive.state == "enabled"  # the first remote frame arms it
    answers_to(drive, GUARD)
    drive.nodes.sync(59)
    assert drive.nodes.take(EMCY) == []
    drive.nodes.sync()
    assert drive.nodes.take(EMCY)[0][:3] == b"\x30\x81\x11"
    drive.nodes.sync(100)
    assert drive.state == "fault"
    assert answers_to(drive, GUARD) == [bytes((0x80 | PRE_OPERATIONAL,))]  # 1029h:01
    drive.control(0x80)
    assert drive.get(0x1001) == 0


@pytest.mark.parametrize("index", [0x100C, 0x100D])
def test_no_life_time_is_no_life_guarding(drive: SdoDrive, index: int) -> None:
    drive.set(index, 2)
    answers_to(drive, GUARD)
    drive.nodes.sync(50)
    assert drive.nodes.take(EMCY) == []


def sends_on_request(drive: SdoDrive, kind: int) -> None:
    drive.set(0x1800, OFF | TPDO, 1)
    drive.set(0x1800, kind, 2)
    drive.set(0x1800, TPDO, 1)
    drive.nodes.operational()
    drive.nodes.frames.clear()
    drive.nodes.sync(5)
    assert drive.nodes.take(TPDO) == []


def test_type_253_sends_the_present_values_on_request_alone(drive: SdoDrive) -> None:
    sends_on_request(drive, 253)
    assert answers_to(drive, TPDO) == [b"\x50\x02"]
    drive.control(6)
    assert answers_to(drive, TPDO) == [b"\x31\x02"]


def test_type_252_sends_the_values_of_the_last_sync(drive: SdoDrive) -> None:
    sends_on_request(drive, 252)
    drive.control(6)
    assert answers_to(drive, TPDO) == [b"\x50\x02"]
    drive.nodes.sync()
    assert answers_to(drive, TPDO) == [b"\x31\x02"]


def test_other_types_answer_a_remote_frame_too_unless_bit_30_forbids_it(drive: SdoDrive) -> None:
    drive.nodes.operational()
    assert drive.get(0x1800, 1) == NOT_ON_REQUEST | TPDO
    assert answers_to(drive, TPDO) == []
    drive.set(0x1800, TPDO, 1)
    assert answers_to(drive, TPDO) == [b"\x50\x02"]


@pytest.mark.parametrize("kind", [252, 253])
def test_no_rpdo_is_requested(drive: SdoDrive, kind: int) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1400, kind, 2)
    assert refusal.value.code == 0x06090030


def test_an_error_of_a_consumed_node_stops_the_axis(drive: SdoDrive) -> None:
    drive.set(0x1028, SCALE_EMCY, SCALE)
    drive.nodes.operational()
    drive.enable(3)
    drive.nodes.put(SCALE_EMCY, bytes(8))
    drive.nodes.put(SCALE_EMCY, b"\x00\x50\x01")
    assert drive.state == "enabled"
    drive.nodes.frames.clear()
    drive.nodes.put(SCALE_EMCY, b"\x00\x50\x21\x00\x00\x00\x00\x00")
    drive.nodes.sync(100)
    assert drive.nodes.take(EMCY)[0] == b"\x10\xff\x11\x0b\x00\x50\x00\x00"
    assert drive.state == "fault"
    drive.nodes.put(SCALE_EMCY, bytes(8))
    drive.control(0x80)
    assert (drive.state, drive.get(0x1001)) == ("switch on disabled", 0)


def test_no_node_consumes_an_emergency_by_default(drive: SdoDrive) -> None:
    drive.enable(3)
    drive.nodes.put(SCALE_EMCY, b"\x00\x50\x21\x00\x00\x00\x00\x00")
    drive.nodes.sync(20)
    assert drive.state == "enabled"


@pytest.mark.parametrize(("node", "cob_id", "code"), [(DRIVE, EMCY, 0x06040043), (11, 0x601, 0x06090030)])
def test_consumed_emergencies_are_those_of_others(drive: SdoDrive, node: int, cob_id: int, code: int) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1028, cob_id, node)
    assert refusal.value.code == code


def test_a_configuration_is_verified_until_something_changes(drive: SdoDrive) -> None:
    drive.set(0x6081, counts(50))
    drive.set(0x1020, 15_000, 1)
    drive.set(0x1020, 43_200_000, 2)
    drive.set(0x1010, 0x6576_6173, 1)
    drive.set(0x6060, 1)  # a command is not a configuration
    drive.nodes.put(0, bytes((129, DRIVE)))
    assert (drive.get(0x1020, 1), drive.get(0x1020, 2)) == (15_000, 43_200_000)
    assert drive.get(0x6081) == counts(50)
    drive.set(0x6083, counts(1000))
    assert (drive.get(0x1020, 1), drive.get(0x1020, 2)) == (0, 0)


def test_restoring_the_defaults_is_a_change_of_the_configuration(drive: SdoDrive) -> None:
    drive.set(0x1020, 1, 1)
    drive.set(0x1011, 0x6461_6F6C, 1)
    assert drive.get(0x1020, 1) == 0


def test_the_manufacturer_status_shows_nmt_state_power_and_homing(drive: SdoDrive) -> None:
    assert drive.get(0x1002) == PRE_OPERATIONAL
    drive.nodes.operational()
    drive.set(0x6098, 37)
    drive.enable(6)
    assert drive.get(0x1002) == 0x1_0000 | OPERATIONAL
    drive.control(0x1F)
    assert drive.get(0x1002) == 0x3_0000 | OPERATIONAL
    drive.control(0x11F)
    assert drive.get(0x1002) == 0x7_0000 | OPERATIONAL
    scale = drive.nodes.remote(SCALE)
    assert scale.sdo[0x1002].raw == OPERATIONAL
