from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from stub_status import first_status

from servo_ctrl.canopen.watch import EMCY_TEXTS
from servo_ctrl.daemon.machine_figures import DOUBT
from servo_ctrl.hmi.advice import CODES, UNKNOWN_CODE, UNKNOWN_REASON, of_code, of_reason
from servo_ctrl.hmi.faults import faults_of

if TYPE_CHECKING:
    from servo_ctrl.config.local_status import Status


def test_a_code_without_an_entry_gets_the_advice_of_its_class() -> None:
    assert of_code(0x8611) is CODES["8611"]
    assert of_code(0x86FF) is CODES["86"]
    assert of_code(0x2FFF) is CODES["2"]
    assert of_code(0xFF01) is CODES["F"]
    assert of_code(0x0000) is UNKNOWN_CODE


@pytest.mark.parametrize("code", [value for _, value, _ in EMCY_TEXTS if value != 0xFF00])
def test_every_code_that_the_controller_has_words_for_has_advice(code: int) -> None:
    assert of_code(code) is not UNKNOWN_CODE


@pytest.mark.parametrize(
    "reason",
    [
        "axis x: following error of 1.2 mm exceeds 1 mm",
        "axis y: at 101.2 mm, beyond limits.position_mm",
        "axis.x.drive: its cyclic inputs do not come any more",
        "axis.x.drive (node 1): no heartbeat in 300 cycles",
        "40 ticks were missed at one go: this computer is too busy",
        "axis x: the drive did not finish homing in 60 s",
        "axis x: the positive limit switch has closed",
        "axis x: encoder and scale are -9.032 mm apart, more than 0.5 mm; check scale and coupling",
        "axis x: runs away from its set point, against 120 N; check the signs of feedback and current",
        "axis x: gets faster while its drive brakes; check the feedback's sign",
        "axis x: force at its limit for 200 ms without a break; is something in its way?",
        "axis.x.drive: answers a SYNC twice: two nodes have its id, or somebody sends in its name",
        "axis.x.drive (node 1): a TPDO of 3 bytes, which is not its mapping",
        "axis.x.drive (node 1): somebody else writes 6065h:00 (following_error_window)",
    ],
)
def test_the_machines_own_reasons_have_advice(reason: str) -> None:
    assert of_reason(reason) is not UNKNOWN_REASON


def test_reasons_of_their_own_have_words_of_their_own() -> None:
    """None is taken for another because of a word that both have."""
    told = [
        of_reason(reason).what
        for reason in (
            "axis x: the positive limit switch has closed",
            "axis x: at 101.2 mm, beyond limits.position_mm",
            "axis x: encoder and scale are -9.032 mm apart, more than 0.5 mm; check scale and coupling",
            "axis x: runs away from its set point, against 120 N; check the signs of feedback and current",
            "axis x: force at its limit for 200 ms without a break; is something in its way?",
            "axis.x.drive: answers a SYNC twice: two nodes have its id, or somebody sends in its name",
            "axis.x.drive (node 1): a TPDO of 3 bytes, which is not its mapping",
            "axis.x.drive (node 1): somebody else writes 6065h:00 (following_error_window)",
            "axis.x.drive (node 1): has restarted, its configuration is gone",
            "bus localcan:x: another controller sends SYNC; only one may run",
            "bus localcan:x: receive overrun: frames were lost",
            "bus localcan:x: bus-off",
        )
    ]
    assert len(set(told)) == len(told)


def test_computer_is_named_first_unless_the_axis_ran_away() -> None:
    assert "computer" in of_reason("axis x: following error of 1.2 mm exceeds 1 mm" + DOUBT).what
    assert of_reason("axis x: runs away from its set point, against 120 N" + DOUBT).todo.startswith("Do not")


def with_fields(**fields: object) -> Status:
    return first_status().model_copy(update=fields)


def test_a_stop_that_was_asked_for_is_no_fault() -> None:
    for wish in ("", "quick stop by the operator", "switched off by the operator", "stopped by SIGTERM"):
        assert faults_of(with_fields(stage="standby", reason=wish)) == []
    gone_wrong = "quick stop by the operator; axis x: the drive reports a fault"
    assert len(faults_of(with_fields(stage="standby", reason=gone_wrong))) == 1
    assert len(faults_of(with_fields(stage="standby", reason="bus-off"))) == 1


def test_an_emergency_in_the_reason_is_explained_by_its_code() -> None:
    [fault] = faults_of(
        with_fields(stage="standby", reason="axis.x.drive (node 1): EMCY 4210h, over-temperature")
    )
    assert fault.advice is CODES["4"]


def test_a_drive_with_an_error_and_a_silent_node_are_told() -> None:
    status = first_status()
    drive = status.drives[0].model_copy(update={"error_code": 0x7320})
    node = status.nodes[1].model_copy(update={"nmt_state": "stopped"})
    changed = with_fields(drives=(drive, status.drives[1]), nodes=(status.nodes[0], node))
    assert [fault.where for fault in faults_of(changed)] == ["Axis X", "axis.x.scale"]
    assert faults_of(changed)[0].advice is CODES["73"]
