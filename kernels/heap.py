"""Memory of large arrays, which a process gives back when it is done with them."""

import ctypes

M_MMAP_THRESHOLD = -3
"""Parameter of glibc's mallopt: from this size on a block has pages of its own."""
LARGE = 1_000_000
"""Bytes: two minutes of a channel at 1 kHz."""


def return_large_arrays() -> None:
    """Have large arrays given back when they are freed; nothing where the library is not glibc.

    glibc raises the threshold to the largest block that was freed, up to 32 MB. Columns of a long recording
    then come from the heap, which grows between them: a third more memory at the end.
    """
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
        library.mallopt(M_MMAP_THRESHOLD, LARGE)
