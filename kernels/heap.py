"""Large arrays that are given back to the system as soon as they are free.

The C library begins so, but once a large array has been freed it takes the next of that size from its heap,
where one small object behind it keeps all of its memory.
"""

import ctypes

MMAP_THRESHOLD = -3
"""M_MMAP_THRESHOLD of mallopt(3), which also ends the C library's own choice of it."""
LARGE_BYTES = 8 * 2**20
"""Chosen: arrays of a million samples, as filters make many, and nothing of a usual recording."""


def give_large_arrays_back() -> None:
    """Have each array of LARGE_BYTES or more mapped by itself, in this process; nothing without glibc."""
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
        library.mallopt(MMAP_THRESHOLD, LARGE_BYTES)
