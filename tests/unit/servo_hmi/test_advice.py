import pytest
from stub_status import first_status

from servo_ctrl.canopen.watch import EMCY_TEXTS
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.machine_state import DISTURBANCE_REMARK
from servo_ctrl.hmi.drive.faults import (
    CODES,
    UNKNOWN_CODE,
    UNKNOWN_REASON,
    advice_for_code,
    advice_for_reason,
    faults_in,
)


def test_a_code_without_an_entry_gets_the_advice_of_its_class() -> None:
    assert advice_for_code(0x8611) is CODES["8611"]
    assert advice_for_code(0x86FF) is CODES["86"]
    assert advice_for_code(0x2FFF) is CODES["2"]
    assert advice_for_code(0xFF01) is CODES["F"]
    assert advice_for_code(0x0000) is UNKNOWN_CODE


@pytest.mark.parametrize("code", [value for _, value, _ in EMCY_TEXTS if value != 0xFF00])
def test_every_code_that_the_controller_knows_has_advice(code: int) -> None:
    assert advice_for_code(code) is not UNKNOWN_CODE


@pytest.mark.parametrize(
    "reason",
    [
        "axis x: following error of 1.2 mm exceeds 1 mm",
        "axis y: at 101.2 mm, beyond limits.position_mm",
        "axis.x.drive: its TPDOs are no longer received",
        "axis.x.drive (node 1): no heartbeat in 300 cycles",
        "40 consecutive ticks were missed: this computer is too busy",
        "axis x: the drive did not finish homing in 60 s",
        "axis x: the positive limit switch has closed",
        "axis x: encoder and scale are -9.032 mm apart, more than 0.5 mm; check scale and coupling",
        "axis x: runs away from its set point, against 120 N; check the signs of feedback and current",
        "axis x: accelerates while its drive brakes; check the sign of the feedback",
        "axis x: force saturated for 200 ms; check for an obstruction",
        (
            "axis.x.drive: answers a SYNC twice: two nodes share its node id, "
            "or another participant sends its TPDOs"
        ),
        "axis.x.drive (node 1): a TPDO of 3 bytes, which contradicts its mapping",
        "axis.x.drive (node 1): another participant writes 6065h:00 (following_error_window)",
    ],
)
def test_every_reason_of_the_controller_has_advice(reason: str) -> None:
    assert advice_for_reason(reason) is not UNKNOWN_REASON


def test_different_reasons_have_different_advice() -> None:
    """No reason matches the entry of another because they share a word."""
    problems = [
        advice_for_reason(reason).problem
        for reason in (
            "axis x: the positive limit switch has closed",
            "axis x: at 101.2 mm, beyond limits.position_mm",
            "axis x: encoder and scale are -9.032 mm apart, more than 0.5 mm; check scale and coupling",
            "axis x: runs away from its set point, against 120 N; check the signs of feedback and current",
            "axis x: force saturated for 200 ms; check for an obstruction",
            (
                "axis.x.drive: answers a SYNC twice: two nodes share its node id, "
                "or another participant sends its TPDOs"
            ),
            "axis.x.drive (node 1): a TPDO of 3 bytes, which contradicts its mapping",
            "axis.x.drive (node 1): another participant writes 6065h:00 (following_error_window)",
            "axis.x.drive (node 1): has restarted, its configuration is gone",
            "bus localcan:x: another controller sends SYNC; only one may run",
            "bus localcan:x: receive overrun: frames were lost",
            "bus localcan:x: bus-off",
        )
    ]
    assert len(set(problems)) == len(problems)


def test_a_busy_computer_comes_before_the_fault_unless_the_axis_ran_away() -> None:
    assert (
        "computer"
        in advice_for_reason("axis x: following error of 1.2 mm exceeds 1 mm" + DISTURBANCE_REMARK).problem
    )
    assert advice_for_reason(
        "axis x: runs away from its set point, against 120 N" + DISTURBANCE_REMARK
    ).remedy.startswith("Do not")


def with_fields(**fields: object) -> MachineStatus:
    return first_status()._replace(**fields)


def test_a_requested_stop_is_no_fault() -> None:
    for requested in ("", "quick stop by the operator", "switched off by the operator", "stopped by SIGTERM"):
        assert not list(faults_in(with_fields(stage=Stage.STANDBY, reason=requested)))
    gone_wrong = "quick stop by the operator; axis x: the drive reports a fault"
    assert len(list(faults_in(with_fields(stage=Stage.STANDBY, reason=gone_wrong)))) == 1
    assert len(list(faults_in(with_fields(stage=Stage.STANDBY, reason="bus-off")))) == 1


def test_an_emergency_in_the_reason_is_explained_by_its_code() -> None:
    [fault] = faults_in(
        with_fields(stage=Stage.STANDBY, reason="axis.x.drive (node 1): EMCY 4210h, over-temperature")
    )
    assert fault.advice is CODES["4"]


def test_a_drive_error_and_a_silent_node_are_faults() -> None:
    status = first_status()
    drive = status.drives[0]._replace(error_code=0x7320)
    node = status.nodes[1]._replace(nmt_state="stopped")
    changed = with_fields(drives=(drive, status.drives[1]), nodes=(status.nodes[0], node))
    on_axis, on_node = faults_in(changed)
    assert (on_axis.where, on_node.where) == ("Axis X", "axis.x.scale")
    assert on_axis.advice is CODES["73"]
