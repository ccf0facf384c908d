"""Memory of large arrays goes back to the system when they are freed."""

import subprocess
import sys

SCRIPT = """
import resource
import numpy as np
from kernels.heap import return_large_arrays

def resident_mb():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6

{first}
np.ones(3_000_000)  # freed: glibc takes its size for the threshold
arrays = [np.ones(500_000) for _ in range(40)]
before_mb = resident_mb()
del arrays[:-1]  # the last one keeps a heap from shrinking
print(before_mb - resident_mb())
"""


def freed_mb(first: str) -> float:
    script = SCRIPT.format(first=first)
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    return float(done.stdout)


def test_large_arrays_are_given_back_although_a_later_one_is_kept() -> None:
    assert freed_mb("return_large_arrays()") > 150.0
    assert freed_mb("") < 50.0, "else the call is of no use here, and this file can go"
