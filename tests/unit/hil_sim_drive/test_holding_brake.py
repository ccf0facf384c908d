"""Holding brake: 60FEh and 2011h in the state machine, on an axis that hangs on its motor."""

from collections.abc import Iterable
from pathlib import Path

import canopen
import pytest
from in_process_nodes import IDEAL_AXIS, InProcessNodes, SdoDrive, counts

RELEASE_MS, SET_MS = 40, 60
BRAKE = f"""
[axis.x.brake]
torque_nm = 5.0
release_ms = {RELEASE_MS}.0
engage_ms = {SET_MS}.0
[axis.x.constant_force]
force_n = -400.0
"""
SO, OE, SOD, FAULT = "switched on", "enabled", "switch on disabled", "fault"
VERTICAL_MM = 0.5
"""Tolerance of the position (mm): the axis sags while the control loops take over the weight."""


@pytest.fixture
def drive(tmp_path: Path) -> SdoDrive:
    text = IDEAL_AXIS.read_text(encoding="utf-8").replace("../../eds", str(IDEAL_AXIS.parents[2] / "eds"))
    plant = tmp_path / "plant.toml"
    plant.write_text(text + BRAKE, encoding="utf-8")
    drive = SdoDrive(InProcessNodes(plant))
    drive.set(0x605B, 1)
    return drive


def switch_on(drive: SdoDrive, mode: int = 3) -> None:
    drive.set(0x6060, mode)
    for word in (0x06, 0x07, 0x0F):
        drive.control(word)


def is_set(drive: SdoDrive) -> bool:
    return bool(drive.get(0x60FE, 1) & 1)


def states(drive: SdoDrive, cycles: int) -> Iterable[tuple[str, bool]]:
    """Return state and brake output of every cycle."""
    for _ in range(cycles):
        drive.nodes.sync()
        yield drive.state, is_set(drive)


def test_the_times_of_the_brake_are_the_defaults_and_without_a_brake_there_are_none(drive: SdoDrive) -> None:
    assert (drive.get(0x2011, 1), drive.get(0x2011, 2)) == (RELEASE_MS, SET_MS)
    bare = SdoDrive(InProcessNodes())
    assert (bare.get(0x2011, 1), bare.get(0x2011, 2)) == (0, 0)
    switch_on(bare)
    assert bare.state == OE


def test_operation_is_enabled_when_the_brake_has_been_released(drive: SdoDrive) -> None:
    assert is_set(drive)
    switch_on(drive)
    assert drive.state == SO
    seen = list(states(drive, RELEASE_MS + 1))
    assert seen[: RELEASE_MS - 1] == [(SO, False)] * (RELEASE_MS - 1)
    assert seen[-1] == (OE, False)


@pytest.mark.parametrize(("mode", "word", "then"), [(1, 0x07, SO), (3, 0x06, "ready"), (8, 0x02, SOD)])
def test_a_hanging_axis_does_not_drop_from_power_up_to_power_off(
    drive: SdoDrive, mode: int, word: int, then: str
) -> None:
    drive.nodes.sync(100)
    assert drive.position_mm == 0.0
    switch_on(drive, mode)
    lowest = 0.0
    for _ in range(200):
        drive.nodes.sync()
        lowest = min(lowest, drive.position_mm)
    drive.control(word)
    while drive.state != then:
        drive.nodes.sync()
        lowest = min(lowest, drive.position_mm)
    drive.nodes.sync(200)
    assert min(lowest, drive.position_mm) > -VERTICAL_MM
    assert is_set(drive)


@pytest.mark.parametrize("subindex", [1, 2])
def test_with_a_time_that_is_too_short_it_drops_or_moves_against_the_brake(
    drive: SdoDrive, subindex: int
) -> None:
    drive.set(0x2011, 0, subindex)
    switch_on(drive)
    drive.set(0x60FF, counts(30))
    drive.nodes.sync(10)
    assert (drive.state == OE) is (subindex == 1)
    if subindex == 1:  # the brake still holds
        assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=1.0)
        return
    drive.set(0x60FF, 0)
    drive.nodes.sync(200)
    here = drive.position_mm
    drive.control(0x06)
    drive.nodes.sync(200)
    assert drive.position_mm < here - 1.0


def test_power_stays_until_the_brake_is_closed(drive: SdoDrive) -> None:
    switch_on(drive)
    drive.nodes.sync(200)
    drive.control(0x07)
    seen = list(states(drive, SET_MS + 30))
    held = [pair for pair in seen if pair == (OE, True)]
    assert SET_MS - 1 <= len(held) <= SET_MS + 1
    assert seen[-1] == (SO, True)


def test_enable_while_the_brake_closes_waits_and_releases_it_again(drive: SdoDrive) -> None:
    switch_on(drive)
    drive.nodes.sync(200)
    drive.node.rpdo.read()
    drive.nodes.operational()
    drive.control(0x07)
    drive.sync_until(lambda: is_set(drive), 50)
    seen = []
    for _ in range(SET_MS + RELEASE_MS + 10):
        drive.nodes.put(0x201, b"\x0f\x00")
        seen += list(states(drive, 1))
    assert (OE, True) in seen
    assert (SO, False) in seen
    assert seen[-1] == (OE, False)
    assert drive.position_mm > -VERTICAL_MM


@pytest.mark.parametrize("word", [0x07, 0x06, 0x00, 0x02])
def test_another_command_ends_the_wait_for_the_brake(drive: SdoDrive, word: int) -> None:
    switch_on(drive)
    drive.nodes.sync(RELEASE_MS // 2)
    drive.control(word)
    assert is_set(drive)
    drive.nodes.sync(2 * RELEASE_MS)
    assert drive.state == {0x07: SO, 0x06: "ready"}.get(word, SOD)
    assert drive.device.is_idle()


def test_a_second_enable_does_not_restart_the_wait(drive: SdoDrive) -> None:
    switch_on(drive)
    drive.nodes.sync(RELEASE_MS - 5)
    drive.control(0x1F)
    drive.nodes.sync(6)
    assert drive.state == OE


def test_a_fault_while_it_waits_and_one_in_motion_end_with_the_brake_closed(drive: SdoDrive) -> None:
    switch_on(drive)
    drive.nodes.sync(5)
    drive.device.fault(0x8611, 0x20)
    drive.nodes.sync(SET_MS + 60)
    assert (drive.state, is_set(drive)) == (FAULT, True)
    assert drive.position_mm > -1.0


@pytest.mark.parametrize(("option", "state"), [(1, FAULT), (2, SOD), (3, SOD)])
def test_a_lost_master_ends_the_wait(drive: SdoDrive, option: int, state: str) -> None:
    drive.set(0x6007, option)
    switch_on(drive)
    drive.nodes.sync(5)
    drive.nodes.put(0x000, bytes((2, 1)))
    drive.nodes.sync(200)
    drive.nodes.put(0x000, bytes((128, 1)))
    assert (drive.state, is_set(drive)) == (state, True)


def test_disable_voltage_sets_the_brake_at_once(drive: SdoDrive) -> None:
    switch_on(drive)
    drive.nodes.sync(200)
    drive.control(0x00)
    assert (drive.state, is_set(drive)) == (SOD, True)
    drive.nodes.sync(200)
    assert -30.0 < drive.position_mm < -1.0  # it fell until the brake had closed
    assert drive.true_velocity_mm_s == 0.0


def test_the_mask_gives_the_brake_to_the_hand(drive: SdoDrive) -> None:
    drive.set(0x60FE, 1, 2)
    drive.nodes.sync(RELEASE_MS + 20)  # 60FEh:01 is 0: released, without power
    assert not is_set(drive)
    assert drive.position_mm < -0.5
    drive.set(0x60FE, 1, 1)
    drive.nodes.sync(200)
    assert is_set(drive)
    assert drive.true_velocity_mm_s == 0.0
    switch_on(drive)
    drive.nodes.sync(100)
    assert (drive.state, is_set(drive)) == (OE, True)
    drive.set(0x60FE, 0, 2)
    assert not is_set(drive)  # the order with power has it again


def test_only_the_brake_is_an_output(drive: SdoDrive) -> None:
    for subindex in (1, 2):
        with pytest.raises(canopen.SdoAbortedError) as error:
            drive.set(0x60FE, 1 << 16, subindex)
        assert error.value.code == 0x06090030


def test_a_reset_sets_the_brake(drive: SdoDrive) -> None:
    switch_on(drive)
    drive.nodes.sync(100)
    drive.nodes.put(0x000, bytes((129, 1)))
    assert is_set(drive)
