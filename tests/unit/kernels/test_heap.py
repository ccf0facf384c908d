"""Memory of large arrays is given back also where a small object lies behind it."""

import ctypes
import subprocess
import sys

import pytest

PROGRAM = """
import sys
import numpy as np
from kernels.heap import LARGE_BYTES, give_large_arrays_back

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096

if sys.argv[1] == "given back":
    give_large_arrays_back()
np.ones(LARGE_BYTES // 4)  # from its end on the C library takes this size from the heap
before, small = resident(), []
for _ in range(5):
    large = np.ones(LARGE_BYTES // 8 + 1)
    small.append(np.ones(8000))
    held = [large, np.ones(LARGE_BYTES // 8 + 1)]
    small.append(np.ones(8000))
    del large, held
print((resident() - before) / LARGE_BYTES)
"""


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallopt"), reason="only glibc has mallopt")
def test_a_large_array_leaves_nothing_behind() -> None:
    def left(how: str) -> float:
        command = [sys.executable, "-c", PROGRAM, how]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
        return float(done.stdout)

    assert left("given back") < 0.2
    assert left("as the C library does") > 0.9
