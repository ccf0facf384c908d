"""A kernel made ready for its arguments computes what the kernel computes, without another compilation."""

import numpy as np
import pytest

from kernels.arrays import Array
from kernels.jit import kernel, ready_for, signatures


@kernel
def scaled_sum(values: Array, factor: float, count: int) -> float:
    """The sum of the first `count` values, scaled."""
    total = 0.0
    for index in range(count):
        total += factor * values[index]
    return total


def test_a_ready_kernel_computes_what_the_kernel_does_on_the_arguments_of_each_call() -> None:
    values = np.array((0.1, 0.2, 0.3))
    ready = ready_for(scaled_sum, values, 1.0, 0)
    assert ready(values, 3.0, 2) == scaled_sum(values, 3.0, 2) == 3.0 * 0.1 + 3.0 * 0.2
    values[0] = 7.0
    assert ready(values, 1.0, 1) == 7.0
    assert ready(np.array((5.0,)), 2.0, 1) == 10.0  # other memory of the same type
    assert signatures(scaled_sum) == 1


def test_a_ready_kernel_refuses_what_is_no_array() -> None:
    ready = ready_for(scaled_sum, np.zeros(3), 1.0, 0)
    with pytest.raises(TypeError, match="unbox"):
        ready(None, 1.0, 1)


def test_a_kernel_is_made_ready_for_each_layout_of_an_array() -> None:
    values = np.arange(6.0)
    read_only = np.arange(6.0)
    read_only.flags.writeable = False
    for of, expected in ((values, 1.0), (values[::2], 2.0), (read_only, 1.0)):
        assert ready_for(scaled_sum, of, 1.0, 0)(of, 1.0, 2) == expected
