"""One axis in the daemon: from inputs to the drive's set points, by hand calculation."""

import math
from typing import Any

import numpy as np
import pytest
from settled_axis import (
    COUNT_M,
    CSP,
    CSV,
    DISABLED,
    ENABLED,
    FAULT,
    SCALE_COUNT_M,
    SteppedAxis,
    settle,
    values,
)

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.config.kernel_params import with_screw
from servo_ctrl.cyclic.cia402 import SHUTDOWN
from servo_ctrl.cyclic.drive_phases import Phase


def test_drive_that_is_not_enabled_gets_neutral_set_points(cst: tuple[SteppedAxis, Any]) -> None:
    servo, codec = cst
    assert codec.unpack(servo.step((DISABLED, 5000, 0), (0,), None)) == (0x06, 10, 0, 0)
    assert math.isnan(values(servo)["position_command_m"])
    assert values(servo)["motor_position_m"] == 5000 * COUNT_M
    assert values(servo)["statusword"] == DISABLED


def test_force_becomes_torque_in_per_mille_of_the_rated_one(
    cst: tuple[SteppedAxis, Any], machine_with: Any
) -> None:
    servo, codec = cst
    machine = machine_with()
    settle(servo)
    payload = servo.step((ENABLED, 0, 0), (-50,), None)  # 5 um of position error
    axis = machine.axes["x"]
    force_n = values(servo)["force_command_n"]
    torque_nm = force_n * axis.transmission.lead_mm * 1e-3 / (2.0 * math.pi)
    assert force_n > 1.0
    assert codec.unpack(payload) == (0x0F, 10, round(torque_nm / (axis.drive.rated_torque_mnm * 1e-6)), 0)


def test_force_offset_is_sent_separately_when_it_is_mapped(
    cst: tuple[SteppedAxis, Any], machine_with: Any
) -> None:
    servo, codec = cst
    settle(servo)
    _, _, torque, offset = codec.unpack(servo.step((ENABLED, 0, 0), (0,), [0.0, 0.0, 0.0, 40.0]))
    unit_n = machine_with().axes["x"].drive.rated_torque_mnm * 1e-6 * 2.0 * math.pi / 0.010
    assert (torque, offset) == (0, round(40.0 / unit_n))


def test_force_offset_without_an_object_of_its_own_goes_with_the_force(
    machine_with: Any, servo_of: Any
) -> None:
    machine = machine_with(**{'"target_torque", "torque_offset"': '"target_torque"'})
    servo, plan = servo_of(machine)
    settle(servo)
    _, _, torque = plan.rpdo.codec.unpack(servo.step((ENABLED, 0, 0), (0,), [0.0, 0.0, 0.0, 40.0]))
    unit_n = machine.axes["x"].drive.rated_torque_mnm * 1e-6 * 2.0 * math.pi / 0.010
    assert torque == round(40.0 / unit_n)


def test_position_mode_sends_the_reference_in_counts(machine_with: Any, servo_of: Any) -> None:
    servo, plan = servo_of(machine_with("disturbance_observer", "friction_compensation", "fuzzy_pd", **CSP))
    codec = plan.rpdo.codec
    assert codec.unpack(servo.step((DISABLED, 4321, 0), (0,), None))[2] == 4321  # no jump when it is enabled
    settle(servo, counts=4321)
    payload = servo.step((ENABLED, 4321, 0), (0,), [4321 * COUNT_M + 1e-5, 0.0, 0.0, 0.0])
    assert codec.unpack(payload)[:3] == (0x0F, 8, 4321 + round(1e-5 / COUNT_M))


def test_position_mode_sends_the_command_with_the_correction_and_goes_there_smoothly(
    machine_with: Any, servo_of: Any
) -> None:
    servo, plan = servo_of(machine_with("disturbance_observer", "friction_compensation", "fuzzy_pd", **CSP))
    settle(servo)
    at_rest = (ENABLED, 0, 0), (0,), None
    servo.step(*at_rest)
    assert values(servo)["correction_m"] == 0.0
    servo.change_params(with_screw(servo.params, np.array([[0.0], [7e-6]])))
    sent = [plan.rpdo.codec.unpack(servo.step(*at_rest))[2] for _ in range(100)]
    assert sent[-1] == round(-7e-6 / COUNT_M)
    assert values(servo)["correction_m"] == -7e-6
    assert values(servo)["position_command_m"] == 0.0
    assert abs(sent[0]) <= 1  # no jump
    assert np.abs(np.diff(sent, 2)).max() <= 1e-6 / COUNT_M + 2  # 1 m/s^2, and rounding


def test_what_is_changed_while_other_parameters_are_tried_acts_behind_the_trial(
    machine_with: Any, servo_of: Any
) -> None:
    servo, _ = servo_of(machine_with("disturbance_observer", "friction_compensation", "fuzzy_pd", **CSP))
    settle(servo)
    at_rest = (ENABLED, 0, 0), (0,), None
    servo.try_params(servo.params)
    servo.change_params(with_screw(servo.params, np.array([[0.0], [7e-6]])))
    for _ in range(100):
        servo.step(*at_rest)
    assert values(servo)["correction_m"] == 0.0
    servo.end_trial()
    for _ in range(100):
        servo.step(*at_rest)
    assert values(servo)["correction_m"] == -7e-6


def test_velocity_mode_sends_counts_per_second(machine_with: Any, servo_of: Any) -> None:
    machine = machine_with("disturbance_observer", **CSV)
    servo, plan = servo_of(machine)
    settle(servo)
    payload = servo.step((ENABLED, 0, 0), (0,), [0.0, 0.02, 0.0, 0.0])
    ahead = machine.axes["x"].control.velocity_feedforward * 0.02
    assert plan.rpdo.codec.unpack(payload)[:3] == (0x0F, 9, round(ahead / COUNT_M))


@pytest.mark.parametrize("inputs", [(None, (0,)), ((ENABLED, 0, 0), None), (None, None)])
def test_missing_input_keeps_the_last_set_point(
    cst: tuple[SteppedAxis, Any], inputs: tuple[Any, Any]
) -> None:
    servo, codec = cst
    settle(servo)
    before = codec.unpack(servo.step((ENABLED, 0, 0), (-50,), None))
    after = codec.unpack(servo.step(*inputs, None))
    assert after == before
    assert math.isnan(values(servo)["position_error_m"])
    assert not servo.events


def test_missed_cycle_does_not_look_like_a_jump(cst: tuple[SteppedAxis, Any]) -> None:
    """100 counts a cycle, one cycle not seen: 200 counts at the next, and still 100 a cycle."""
    servo, _ = cst
    settle(servo)
    for step in range(1, 20):
        servo.step((ENABLED, 100 * step, 0), (round(100 * step * COUNT_M / SCALE_COUNT_M),), None)
    steady = values(servo)["motor_velocity_m_s"]
    servo.skip_cycles(1)
    servo.step((ENABLED, 2100, 0), (round(2100 * COUNT_M / SCALE_COUNT_M),), None)
    assert values(servo)["motor_velocity_m_s"] == pytest.approx(steady, rel=0.02)


@pytest.mark.parametrize("lost", ["ticks", "inputs"])
def test_gap_while_the_axis_accelerates_makes_no_force_pulse(cst: tuple[SteppedAxis, Any], lost: str) -> None:
    """1 m/s^2 over a gap of 9 periods: a guess from before would be 50 um, 50 mm/s, 750 N off."""
    servo, _ = cst
    settle(servo)
    period_s, gap, force_n = 1e-3, 9, []
    for k in [*range(1, 50), *range(50 + gap, 70)]:
        if k == 50 + gap:
            if lost == "ticks":
                servo.skip_cycles(gap)
            else:
                for _ in range(gap):
                    servo.step(None, None, [0.0, 0.0, 0.0, 0.0])
        moved_m = 0.5 * (k * period_s) ** 2
        servo.step(
            (ENABLED, round(moved_m / COUNT_M), 0),
            (round(moved_m / SCALE_COUNT_M),),
            [moved_m, k * period_s, 1.0, 0.0],
        )
        force_n.append(values(servo)["force_command_n"])
    lag_m_s = gap * period_s / 2.0  # a mean over the gap is as old as its middle
    assert abs(force_n[49] - force_n[48]) < 15000.0 * (lag_m_s + 2e-3)
    assert abs(force_n[50] - force_n[48]) < 0.25 * 600.0


def test_following_error_is_an_event_that_names_axis_and_limit(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst
    settle(servo)
    servo.step((ENABLED, 0, 0), (-10_001,), None)
    assert servo.events == [(Event.FOLLOWING_ERROR, "axis x: following error of 1.000 mm exceeds 1 mm")]


def test_non_finite_set_point_is_an_event(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst
    settle(servo)
    servo.step((ENABLED, 0, 0), (0,), [math.nan, 0.0, 0.0, 0.0])
    assert [event for event, _ in servo.events] == [Event.BAD_COMMAND]


def test_drive_fault_in_motion_is_an_event_and_ends_the_set_points(cst: tuple[SteppedAxis, Any]) -> None:
    servo, codec = cst
    settle(servo)
    payload = servo.step((FAULT, 0, 0), (-50,), None)
    assert servo.events == [(Event.DRIVE_FAULT, "axis x: the drive is in fault")]
    assert codec.unpack(payload) == (0x00, 10, 0, 0)
    assert servo.phase is Phase.DISABLING
    servo.step((ENABLED, 0, 0), (-50,), None)
    assert math.isnan(values(servo)["position_command_m"]), "it is not taken over again"


def test_frozen_scale_under_a_moving_motor_is_an_event_with_its_limit(cst: tuple[SteppedAxis, Any]) -> None:
    servo, _ = cst
    settle(servo)
    servo.step((ENABLED, round(0.4e-3 / COUNT_M), 0), (0,), None)
    assert servo.events == []
    servo.step((ENABLED, round(0.6e-3 / COUNT_M), 0), (0,), None)
    (found,) = servo.events
    assert found[0] is Event.SENSORS_DISAGREE
    assert "0.600 mm apart, more than 0.5 mm" in found[1]


@pytest.mark.parametrize(
    ("speed_m_s", "behind_mm", "age", "seen"),
    [(0.1, 0.7, 0, True), (0.1, 0.7, 3, False), (0.1, 0.9, 3, True), (0.0, 0.7, 3, True)],
)
def test_scale_of_an_earlier_cycle_may_differ_by_the_travel_since(
    cst: tuple[SteppedAxis, Any], speed_m_s: float, behind_mm: float, age: int, seen: bool
) -> None:
    servo, _ = cst
    settle(servo)
    servo.input_age(age)
    for cycle in range(1, 40):
        servo.events.clear()
        at_m = cycle * speed_m_s * 1e-3
        scale = round((at_m - behind_mm * 1e-3) / SCALE_COUNT_M)
        servo.step((ENABLED, round(at_m / COUNT_M), 0), (scale,), [at_m, speed_m_s, 0.0, 0.0])
    assert [event for event, _ in servo.events] == [Event.SENSORS_DISAGREE] * seen


def test_a_drive_gets_no_power_while_that_is_not_allowed(cst: tuple[SteppedAxis, Any]) -> None:
    servo, codec = cst
    allowed = False
    servo.power_allowed = lambda: allowed
    sent = [codec.unpack(servo.step((DISABLED, 0, 0), (0,), None))[0] for _ in range(50)]
    assert set(sent) == {SHUTDOWN}
    assert not servo.events
    allowed = True
    settle(servo)
