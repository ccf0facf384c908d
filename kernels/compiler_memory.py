"""Returns the memory of the compiler's library to the system once kernels are loaded.

Loading kernels from the disk touches most of LLVM's library, 68 MB; running them touches none of it. The
pages are clean copies of a file, so the system reads them again if a kernel is compiled later.
"""

import ctypes
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from kernels.heap import trim_heap

LIBRARY = "libllvmlite"
MAPS = Path("/proc/self/smaps")
MADV_DONTNEED = 4
CHANGED = ("Private_Dirty:", "Shared_Dirty:", "Anonymous:", "Locked:", "Swap:")
"""Entries of smaps in kB; a mapping is released only if all of them are 0."""
_MAPPING = re.compile(r"^([0-9a-f]+)-([0-9a-f]+) (\S{4}) \S+ \S+ \S+ *(.*)$")


class Mapping(NamedTuple):
    """A span of the address space that maps a file and was never written to."""

    start: int
    size: int


def clean_mappings(lines: Iterable[str], library: str) -> Iterator[Mapping]:
    """Yield the mappings of a library's file that are read-only, unchanged and not locked.

    `lines` are those of /proc/PID/smaps. A page that differs from its file (relocations) counts as
    anonymous there and would be lost: no mapping with such a page is yielded.
    """
    found: Mapping | None = None
    for line in lines:
        if header := _MAPPING.match(line):
            if found is not None:
                yield found
            start, end, permissions, file = header.groups()
            ours = library in file.rpartition("/")[2] and "w" not in permissions
            found = Mapping(int(start, 16), int(end, 16) - int(start, 16)) if ours else None
        elif line.startswith(CHANGED) and int(line.split()[1]):
            found = None
    if found is not None:
        yield found


def release_compiler() -> None:
    """Release the memory of the compiler's library and free memory of the heap; do nothing outside Linux."""
    trim_heap()
    if not MAPS.exists():
        return
    library = ctypes.CDLL(None, use_errno=True)
    lines = MAPS.read_text(encoding="ascii", errors="replace").splitlines()
    for mapping in clean_mappings(lines, LIBRARY):
        library.madvise(ctypes.c_void_p(mapping.start), ctypes.c_size_t(mapping.size), MADV_DONTNEED)
