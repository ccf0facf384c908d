"""Arrays on their way into a kernel."""

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from kernels.arrays import Array, compiled_layout

COLUMN = np.arange(6.0)


def read_only(values: Array) -> Array:
    values = values.copy()
    values.flags.writeable = False
    return values


@pytest.mark.parametrize(
    "values",
    [np.arange(6), COLUMN, read_only(COLUMN), np.repeat(COLUMN, 2)[::2], COLUMN.astype(np.float32)],
    ids=["integers", "as it should be", "read only", "strided", "single precision"],
)
def test_any_vector_becomes_the_one_type_that_kernels_are_compiled_for(values: NDArray[np.number]) -> None:
    ready = compiled_layout(values)
    assert numba.typeof(ready) == numba.float64[::1]
    np.testing.assert_array_equal(ready, COLUMN)


def test_what_is_right_already_is_not_copied() -> None:
    assert compiled_layout(COLUMN) is COLUMN
