"""Returns memory to the system: large arrays as soon as they are freed, the rest of the heap on request.

By default glibc does so only until the first large array is freed: it then takes arrays of that size from the
heap, where one small object behind an array keeps all of its memory.
"""

import ctypes

MMAP_THRESHOLD = -3
"""M_MMAP_THRESHOLD of mallopt(3); to set it also ends its automatic adjustment."""
LARGE_BYTES = 8 * 2**20
"""Least size of an array that is mapped alone. Chosen: filters make many arrays of a million samples."""


def give_large_arrays_back() -> None:
    """Map each array of LARGE_BYTES or more of this process alone; do nothing without glibc."""
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
        library.mallopt(MMAP_THRESHOLD, LARGE_BYTES)


def trim_heap() -> None:
    """Return the free memory of the heap to the system; do nothing without glibc."""
    library = ctypes.CDLL(None)
    if hasattr(library, "malloc_trim"):
        library.malloc_trim(0)
