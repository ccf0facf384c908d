"""Remapping at run time: the sequence of CiA 301 is accepted, others are refused."""

import canopen
import pytest
from in_process_nodes import DRIVE, InProcessNodes, SdoDrive, pack

OFF = 0x80000000
CANNOT_MAP, TOO_LONG, RANGE, STATE, NO_OBJECT = 0x06040041, 0x06040042, 0x06090030, 0x08000022, 0x06020000


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def refused(drive: SdoDrive, index: int, value: int, subindex: int) -> int:
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(index, value, subindex)
    return refusal.value.code


def opened(drive: SdoDrive, index: int) -> None:
    """Disable the PDO and clear its mapping."""
    drive.set(index, drive.get(index, 1) | OFF, 1)
    drive.set(index + 0x200, 0, 0)


def test_canopens_own_pdo_configuration_works_while_operational(drive: SdoDrive) -> None:
    drive.nodes.operational()
    node = drive.node
    node.tpdo.read()
    pdo = node.tpdo[3]
    pdo.clear()
    pdo.add_variable("Position actual value")
    pdo.add_variable("Torque actual value")
    pdo.trans_type = 1
    pdo.enabled = True
    pdo.save()
    drive.nodes.sync()
    assert pdo.data == pack("ih", 0, 0)
    node.tpdo.read()
    assert [variable.index for variable in node.tpdo[3].map] == [0x6064, 0x6077]


def test_mapping_of_a_pdo_that_is_on_is_refused(drive: SdoDrive) -> None:
    assert refused(drive, 0x1600, 0, 0) == STATE
    assert refused(drive, 0x1600, 0x60400010, 1) == STATE


def test_entries_can_only_change_while_the_number_is_zero(drive: SdoDrive) -> None:
    drive.set(0x1400, drive.get(0x1400, 1) | OFF, 1)
    assert refused(drive, 0x1600, 0x60600008, 2) == STATE


@pytest.mark.parametrize(
    ("index", "entry", "code"),
    [
        (0x1600, 0x60410010, CANNOT_MAP),  # statusword cannot be received
        (0x1A00, 0x60400010, CANNOT_MAP),  # controlword cannot be sent
        (0x1A00, 0x10170010, CANNOT_MAP),  # heartbeat time is not mappable
        (0x1A00, 0x60410020, CANNOT_MAP),  # wrong length
        (0x1A00, 0x00070020, CANNOT_MAP),  # a dummy cannot be sent
        (0x1A00, 0x71230010, NO_OBJECT),
        (0x1A00, 0x607D0320, 0x06090011),
    ],
)
def test_entries_that_cannot_be_mapped_are_refused(
    drive: SdoDrive, index: int, entry: int, code: int
) -> None:
    opened(drive, index - 0x200)
    assert refused(drive, index, entry, 1) == code


def test_more_than_64_bits_are_refused(drive: SdoDrive) -> None:
    opened(drive, 0x1800)
    for number, entry in enumerate((0x60640020, 0x606C0020, 0x60410010), 1):
        drive.set(0x1A00, entry, number)
    assert refused(drive, 0x1A00, 3, 0) == TOO_LONG
    drive.set(0x1A00, 2, 0)


def test_more_than_eight_entries_are_refused(drive: SdoDrive) -> None:
    opened(drive, 0x1800)
    assert refused(drive, 0x1A00, 9, 0) == RANGE


@pytest.mark.parametrize("cob_id", [0x000, 0x080 - 1, 0x101, 0x581, 0x601, 0x701, 0x20000181])
def test_restricted_identifiers_are_refused(drive: SdoDrive, cob_id: int) -> None:
    opened(drive, 0x1800)
    assert refused(drive, 0x1800, cob_id, 1) == RANGE


def test_identifier_of_a_pdo_that_is_on_cannot_change(drive: SdoDrive) -> None:
    assert refused(drive, 0x1800, 0x190, 1) == STATE


@pytest.mark.parametrize("transmission", [241, 251])
def test_reserved_types_are_refused(drive: SdoDrive, transmission: int) -> None:
    assert refused(drive, 0x1800, transmission, 2) == RANGE


def test_inhibit_time_of_a_pdo_that_is_on_is_refused(drive: SdoDrive) -> None:
    assert refused(drive, 0x1800, 5, 3) == STATE


def test_a_pdo_can_move_to_another_identifier(drive: SdoDrive) -> None:
    opened(drive, 0x1800)
    drive.set(0x1A00, 0x60410010, 1)
    drive.set(0x1A00, 1, 0)
    drive.set(0x1800, 1, 2)
    drive.set(0x1800, 0x1B5, 1)
    drive.nodes.operational()
    drive.nodes.frames.clear()
    drive.nodes.sync()
    assert len(drive.nodes.take(0x1B5)) == 1
    assert DRIVE == 1
