"""Objects that describe the drive's hardware: encoders, units, ratings, name plates."""

from pathlib import Path

import canopen
import pytest
from in_process_nodes import IDEAL_AXIS, InProcessNodes, SdoDrive, counts

TURN = 1_048_576


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def without_scale(tmp_path: Path) -> SdoDrive:
    text = IDEAL_AXIS.read_text(encoding="utf-8").replace("../../eds", str(IDEAL_AXIS.parents[2] / "eds"))
    before, rest = text.split("[axis.x.scale]")
    plant = tmp_path / "plant.toml"
    plant.write_text(before + rest[rest.index("[axis.x.motor]") :], encoding="utf-8")
    return SdoDrive(InProcessNodes(plant))


@pytest.mark.parametrize(
    ("index", "members"),
    [
        (0x608F, (TURN, 1)),
        (0x6090, (TURN, 1)),
        (0x6091, (1, 1)),
        (0x6092, (TURN, 1)),
        (0x6096, (1, 1)),
        (0x6097, (1, 1)),
    ],
)
def test_factors_are_those_of_counts_of_the_encoder(
    drive: SdoDrive, index: int, members: tuple[int, int]
) -> None:
    assert (drive.get(index, 1), drive.get(index, 2)) == members


@pytest.mark.parametrize(("numerator", "divisor"), [(0x60E6, 0x60EB), (0x60E7, 0x60EC), (0x60E9, 0x60EE)])
def test_the_scale_has_so_many_increments_in_a_turn(drive: SdoDrive, numerator: int, divisor: int) -> None:
    assert (drive.get(numerator, 1), drive.get(divisor, 1)) == (100_000, 1)  # 10 mm in steps of 0.1 um


def test_the_scale_moves_with_the_motor(drive: SdoDrive) -> None:
    assert (drive.get(0x60E8, 1), drive.get(0x60ED, 1)) == (1, 1)


def test_an_axis_without_a_scale_has_no_increments_of_it(tmp_path: Path) -> None:
    drive = without_scale(tmp_path)
    assert drive.get(0x60E6, 1) == 0
    with pytest.raises(canopen.SdoAbortedError) as refused:
        drive.set(0x606A, 1)
    assert refused.value.code == 0x06090030


def test_units_are_counts_and_seconds(drive: SdoDrive) -> None:
    assert drive.get(0x608A) == 0xB5
    assert [drive.get(index) for index in (0x60A8, 0x60A9, 0x60AA)] == [0xB50000, 0xB50300, 0xB55700]


def test_the_internal_position_knows_neither_polarity_nor_homing(drive: SdoDrive) -> None:
    drive.set(0x607E, 0xC0)
    drive.set(0x607C, 5000)
    drive.set(0x6098, 37)
    drive.enable(6)
    drive.control(0x1F)
    drive.set(0x6060, 3)
    drive.set(0x60FF, counts(-20))
    drive.nodes.sync(200)
    assert drive.get(0x6063) == pytest.approx(counts(drive.true_position_mm), abs=2)
    assert drive.get(0x6064) == pytest.approx(-5000 - drive.get(0x6063), abs=400)


def test_the_velocity_sensor_is_the_encoder_or_the_scale(drive: SdoDrive) -> None:
    drive.enable(3)
    drive.set(0x60FF, counts(20))
    drive.nodes.sync(200)
    assert drive.get(0x6069) == pytest.approx(counts(20), rel=0.002)
    drive.set(0x606A, 1)
    assert drive.get(0x6069) == pytest.approx(20 * 10_000, rel=0.002)


def test_sensor_values_can_be_sent(drive: SdoDrive) -> None:
    drive.node.tpdo.read()
    pdo = drive.node.tpdo[2]
    pdo.clear()
    pdo.add_variable(0x6063)
    pdo.add_variable(0x6069)
    pdo.trans_type = 1
    pdo.enabled = True
    pdo.save()
    drive.nodes.operational()
    drive.enable(3)
    drive.set(0x60FF, counts(20))
    drive.nodes.sync(100)
    assert pdo.map[0].raw == drive.get(0x6063) > 0
    assert pdo.map[1].raw == drive.get(0x6069)


def test_the_link_has_the_voltage_of_the_amplifier(drive: SdoDrive) -> None:
    assert drive.get(0x6079) == 325_000


def test_current_and_torque_agree_by_the_torque_constant(drive: SdoDrive) -> None:
    drive.enable(10)
    drive.set(0x6071, 100)
    drive.nodes.sync(20)
    current_a = drive.get(0x6078) * 1.5e-3
    torque_nm = drive.get(0x6077) * 0.640e-3
    assert torque_nm == pytest.approx(0.43 * current_a, rel=0.02)
    assert (drive.get(0x6075), drive.get(0x6076)) == (1500, 640)


def test_plates_and_profile(drive: SdoDrive) -> None:
    assert drive.get(0x67FF) == drive.get(0x1000) == 0x20192
    assert drive.get(0x67FE) >> 24 == 4  # CiA 402 version 4
    assert drive.get(0x6402) == 10  # sinusoidal, permanent magnets, brushless
    sdo = drive.node.sdo
    names = [sdo[index].raw for index in (0x1008, 0x1009, 0x100A, 0x6403, 0x6404, 0x6503, 0x6505)]
    assert all(names)
    assert names[0] == drive.node.object_dictionary[0x1008].default
    assert sdo[0x1022].raw == 0  # the stored EDS is plain text


def test_the_supported_modes_can_be_chosen_and_no_others(drive: SdoDrive) -> None:
    supported = drive.get(0x6502)
    for mode in range(1, 11):
        if supported >> (mode - 1) & 1:
            drive.set(0x6060, mode)
            assert drive.get(0x6061) == mode
        else:
            with pytest.raises(canopen.SdoAbortedError):
                drive.set(0x6060, mode)
