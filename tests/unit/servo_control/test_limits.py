"""Saturation of set points, held against numpy's."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.control.limits import clamp

numbers = st.floats(allow_nan=False, allow_infinity=True)


@given(numbers, st.floats(min_value=0.0, allow_nan=False))
def test_clamp_equals_numpys_clip_at_both_limits(value: float, limit: float) -> None:
    assert clamp(value, limit) == np.clip(value, -limit, limit)


def test_clamp_keeps_values_between_the_limits() -> None:
    assert [clamp(value, 2.5) for value in (-math.inf, -3.0, -2.5, -1.0, 0.0, 2.0, 2.5, 2.6)] == [
        *(-2.5, -2.5, -2.5),
        *(-1.0, 0.0, 2.0),
        *(2.5, 2.5),
    ]
