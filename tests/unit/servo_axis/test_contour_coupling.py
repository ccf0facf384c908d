"""The coupling on the records of the cycle: whose errors it takes, and when it lets the axes be."""

import math
from typing import Any

import numpy as np
import pytest

from kernels.record_layout import record_type
from servo_ctrl.control.contour_control import Params
from servo_ctrl.cyclic.axis_record import CycleRecord
from servo_ctrl.cyclic.contour_coupling import Coupling, contour_records, couple_axes

COLUMNS = 4
LAW = Params(kp_1_s=50.0, ki_1_s2=100.0, limit_m_s=1.0, full_speed_m_s=1e-3, period_s=1e-3)
# a is not part of it; y goes along +, x stays: the path goes up, its left is -x
REFERENCE = np.array([9.0, 9.0, 9.0, 0.0, 2e-3, 0.0, 0.0, 0.0, 1e-3, 0.02, 0.0, 0.0])


@pytest.fixture
def axes() -> Any:
    """Axes a, x and y, of which x is 10 um beside the path, by its scale."""
    made = np.zeros(3, record_type(CycleRecord))
    made["engaged"] = True
    made["law"]["params"]["position_loop"]["scale_feedback"] = True
    made["inputs"]["scale_m"] = [math.nan, 2e-3 - 1e-5, 1e-3 - 5e-4]
    made["inputs"]["motor_m"] = [math.nan, 2e-3 - 3e-5, 1e-3]
    return made


def offsets(axes: Any) -> list[float]:
    return [float(value) for value in axes["law"]["sample"]["velocity_offset_m_s"]]


def test_the_error_of_the_scales_in_this_cycle_leads_both_axes(axes: Any) -> None:
    contours = contour_records([Coupling(1, 2, LAW)])
    couple_axes(contours, axes, REFERENCE, COLUMNS, True)
    assert contours[0]["error_m"] == pytest.approx(-1e-5)
    assert offsets(axes) == pytest.approx([0.0, 5.01e-4, 0.0], abs=1e-15)


def test_an_axis_led_by_its_motor_has_its_error_with_the_last_correction(axes: Any) -> None:
    axes["law"]["params"]["position_loop"]["scale_feedback"] = False
    axes["correction_m"] = 5e-6
    contours = contour_records([Coupling(1, 2, LAW)])
    couple_axes(contours, axes, REFERENCE, COLUMNS, True)
    assert contours[0]["error_m"] == pytest.approx(-3.5e-5)


def test_a_missing_input_keeps_the_offsets_for_this_cycle(axes: Any) -> None:
    contours = contour_records([Coupling(1, 2, LAW)])
    couple_axes(contours, axes, REFERENCE, COLUMNS, True)
    before = offsets(axes)
    axes["inputs"]["scale_m"][2] = math.nan
    couple_axes(contours, axes, REFERENCE, COLUMNS, True)
    assert math.isnan(contours[0]["error_m"])
    assert offsets(axes) == before


@pytest.mark.parametrize(("led", "engaged"), [(False, True), (True, False)])
def test_axes_that_are_held_or_not_both_under_control_are_not_coupled(
    axes: Any, led: bool, engaged: bool
) -> None:
    contours = contour_records([Coupling(1, 2, LAW)])
    couple_axes(contours, axes, REFERENCE, COLUMNS, True)
    assert contours[0]["state"]["integral_m_s"] != 0.0
    axes["engaged"][2] = engaged
    couple_axes(contours, axes, REFERENCE, COLUMNS, led)
    assert offsets(axes) == [0.0, 0.0, 0.0]
    assert contours[0]["state"]["integral_m_s"] == 0.0
    assert math.isnan(contours[0]["error_m"])


def test_without_a_pair_nothing_is_touched(axes: Any) -> None:
    before = axes.tobytes()
    couple_axes(contour_records([]), axes, REFERENCE, COLUMNS, True)
    assert axes.tobytes() == before
