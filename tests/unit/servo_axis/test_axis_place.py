"""Position of an axis when it is enabled, and its bounds: limits and limit switches."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from settled_axis import COUNT_M, CSP, DISABLED, ENABLED, HOMED, SCALE_COUNT_M, SteppedAxis, settle, values

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.cyclic.cia402 import SHUTDOWN, SWITCH_ON
from servo_ctrl.cyclic.sequence import HOMING_START_CYCLES, SETTLING_CYCLES

READY = 0x0221


def test_scale_equals_the_motor_position_where_the_axis_is_enabled(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst
    settle(servo, counts=2**20, scale=777)
    assert servo.hold_m == pytest.approx(0.010)
    servo.step((ENABLED, 2**20, 0), (787,), None)
    assert values(servo)["scale_position_m"] == pytest.approx(0.010 + 10 * SCALE_COUNT_M, abs=1e-15)
    assert values(servo)["position_error_m"] == pytest.approx(-10 * SCALE_COUNT_M, abs=1e-15)


def test_axis_is_not_enabled_without_its_inputs(cst: tuple[SteppedAxis, Any]) -> None:
    servo, codec = cst
    for statusword in (DISABLED, DISABLED, ENABLED):
        servo.step((statusword, 1000, 0), None, None)
    assert codec.unpack(servo.step((ENABLED, 1000, 0), None, None))[2] == 0
    assert math.isnan(values(servo)["position_command_m"])
    servo.step((ENABLED, 1000, 0), (5,), None)
    assert values(servo)["position_command_m"] == pytest.approx(1000 * COUNT_M)


@pytest.mark.parametrize(
    ("counts_a_cycle", "given_power"), [(1000, True), (-1000, True), (1100, False), (-1100, False)]
)
def test_axis_is_given_power_below_ten_millimetres_a_second(
    cst: tuple[SteppedAxis, Any], counts_a_cycle: int, given_power: bool
) -> None:
    """1000 counts a millisecond are 9.5 mm/s, 1100 are 10.5 mm/s."""
    servo, codec = cst
    servo.step((DISABLED, 0, 0), (0,), None)
    words = [
        codec.unpack(servo.step((READY, cycle * counts_a_cycle, 0), (0,), None))[0] for cycle in range(1, 20)
    ]
    assert set(words) == {SWITCH_ON if given_power else SHUTDOWN}


def test_axis_of_unknown_position_counts_as_moving(cst: tuple[SteppedAxis, Any]) -> None:
    servo, codec = cst
    known = (READY, 4711, 0)
    words = [codec.unpack(servo.step(drive, (0,), None))[0] for drive in (known, None, known, known)]
    assert words == [SHUTDOWN, SHUTDOWN, SHUTDOWN, SWITCH_ON]


def test_axis_that_could_not_be_enabled_is_not_ready(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst
    for _ in range(2):
        servo.step((DISABLED, 1000, 0), (5,), None)
    for _ in range(SETTLING_CYCLES + 5):
        servo.step((ENABLED, 1000, 0), None, None)
    assert not servo.ready
    for _ in range(SETTLING_CYCLES):
        assert not servo.ready
        servo.step((ENABLED, 1000, 0), (5,), None)
    servo.step((ENABLED, 1000, 0), (5,), None)
    assert servo.ready
    assert servo.hold_m == pytest.approx(1000 * COUNT_M)


def test_missing_scale_at_the_end_of_homing_keeps_the_drive_in_homing_mode(
    machine_with: Callable[..., Any], servo_of: Callable[..., Any]
) -> None:
    """In homing mode, for in csp the drive would be sent to where it was in its old coordinates."""
    servo, plan = servo_of(
        machine_with(
            "disturbance_observer",
            "friction_compensation",
            "fuzzy_pd",
            **{"homing_method = 0": "homing_method = 37", **CSP},
        )
    )
    for _ in range(2):
        servo.step((DISABLED, 4321, 0), (5,), None)
    for _ in range(2 * HOMING_START_CYCLES + 2):
        servo.step((ENABLED, 4321, 0), (5,), None)
    homed = (ENABLED | HOMED, 0, 0)
    for _ in range(3):
        assert plan.rpdo.codec.unpack(servo.step(homed, None, None))[:2] == (0x1F, 6)
        assert not servo.homed
    assert plan.rpdo.codec.unpack(servo.step(homed, (5,), None))[:3] == (0x0F, 8, 0)
    assert servo.homed
    assert servo.hold_m == 0.0


def test_position_beyond_the_limit_is_an_event(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst
    settle(servo)
    far = round(0.1011 / COUNT_M)
    servo.step((ENABLED, far, 0), (round(0.1011 / SCALE_COUNT_M),), [0.1011, 0.0, 0.0, 0.0])
    assert servo.events == [(Event.LIMIT, "axis x: at 101.100 mm, beyond limits.position_mm")]


def test_axis_enabled_beyond_its_limit_may_move_back_and_no_farther_out(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst

    def at(position_m: float) -> list[Event]:
        servo.events.clear()
        inputs = (ENABLED, round(position_m / COUNT_M), 0), (round(position_m / SCALE_COUNT_M),)
        servo.step(*inputs, [position_m, 0.0, 0.0, 0.0])
        return [event for event, _ in servo.events]

    settle(servo, counts=round(0.105 / COUNT_M), scale=round(0.105 / SCALE_COUNT_M))
    assert at(0.1051) == []
    assert at(0.106) == [Event.LIMIT]
    for position_m in (0.104, 0.103, 0.102, 0.1011, 0.1, 0.05, 0.1):
        assert at(position_m) == []
    assert at(0.103) == [Event.LIMIT]


def test_the_position_limit_applies_to_the_table_not_to_the_corrected_motor(
    machine_with: Callable[..., Any], servo_of: Callable[..., Any]
) -> None:
    far_m, correction_m = 0.1008, 0.0005
    servo, _ = servo_of(machine_with())
    settle(servo)
    servo._record["correction_m"] = correction_m
    servo.step((ENABLED, round((far_m + correction_m) / COUNT_M), 0), (round(far_m / SCALE_COUNT_M),), None)
    assert not any(event is Event.LIMIT for event, _ in servo.events)


@pytest.mark.parametrize(
    ("inputs", "side"), [(0b01, "negative"), (0b10, "positive"), (0xFFFF_0002, "positive")]
)
def test_limit_switch_is_an_event_as_it_closes_while_the_axis_is_controlled(
    cst: tuple[SteppedAxis, Any], inputs: int, side: str
) -> None:
    servo, _ = cst
    assert servo.closed_switch(inputs) == ""  # the drive is not enabled yet
    assert servo.closed_switch(0) == ""
    settle(servo)
    assert servo.closed_switch(inputs) == f"axis x: the {side} limit switch has closed"
    assert servo.closed_switch(inputs) == ""
    assert servo.closed_switch(0b100) == ""  # the home switch is none


def test_axis_on_a_switch_may_move_away_from_it(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst
    servo.closed_switch(0b10)
    settle(servo)
    assert servo.closed_switch(0b10) == ""


@pytest.mark.parametrize(("inputs", "side"), [(0b01, "negative"), (0b10, "positive")])
def test_axis_at_a_switch_is_reported(cst: tuple[SteppedAxis, Any], inputs: int, side: str) -> None:
    servo, _ = cst
    assert servo.watch.at_a_switch == ""
    servo.closed_switch(inputs | 0b100)
    assert servo.watch.at_a_switch.startswith(f"axis x stands at its {side} limit switch: jog it away")
    servo.closed_switch(0b100)
    assert servo.watch.at_a_switch == ""
