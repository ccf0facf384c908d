"""The compiled rounding of set points against the one that the other values of the bus use."""

import math

from hypothesis import example, given
from hypothesis import strategies as st

from servo_ctrl.canopen.scaling import to_integer
from servo_ctrl.control.set_point_counts import I16_MAX, SetPointUnits, set_point_counts, whole
from servo_ctrl.control.types import AxisCommand

UNITS = SetPointUnits(
    newton_per_permille=0.5,
    metre_per_count=1e-6,
    metre_per_s_per_unit=1e-6,
    offset_apart=True,
    velocity_offset=False,
)
COMMAND = AxisCommand(
    position_m=0.25,
    velocity_m_s=-0.5,
    force_n=10.0,
    force_offset_n=-2.0,
    position_error_m=0.0,
    motor_velocity_m_s=0.0,
    pulse_m_s=0.0,
    disturbance_n=0.0,
    correction_m=1e-6,
    saturated=False,
    status=0,
)


@given(st.floats(), st.floats(min_value=1e-9, max_value=1e3), st.integers(min_value=1, max_value=2**31 - 1))
@example(2.5, 1.0, I16_MAX)
@example(-3.5, 1.0, I16_MAX)
@example(math.inf, 1.0, I16_MAX)
@example(-math.inf, 1.0, I16_MAX)
@example(math.nan, 1.0, I16_MAX)
def test_it_rounds_as_the_interpreter_does(value: float, unit: float, largest: int) -> None:
    assert whole(value, unit, largest) == to_integer(value, unit, -largest, largest)


def test_each_command_has_its_count() -> None:
    counts = set_point_counts(UNITS, 0.5, COMMAND, 0.1)
    assert counts == (20, -4, -500_000, 250_001, 0)


def test_an_offset_without_an_object_goes_with_the_force() -> None:
    counts = set_point_counts(UNITS._replace(offset_apart=False), 0.5, COMMAND, 0.1)
    assert (counts.torque, counts.torque_offset) == (16, 0)


def test_the_velocity_feedforward_is_an_offset_where_the_drive_takes_one() -> None:
    counts = set_point_counts(UNITS._replace(velocity_offset=True), 0.5, COMMAND, 0.1)
    assert counts.velocity_offset == 50_000
