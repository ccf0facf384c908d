"""The compiler's library gives its memory back, what was written to stays, and kernels compile on."""

import subprocess
import sys

from kernels.compiler_memory import Mapping, clean_mappings

MAPPING = """\
7f0000000000-7f0000200000 r-xp 00001000 fe:00 11 /opt/lib/libllvmlite.so
Rss:                2048 kB
Private_Dirty:         0 kB
Anonymous:             0 kB
Locked:                0 kB
"""
PROGRAM = """
from kernels.jit import uncached_kernel
from kernels.compiler_memory import LIBRARY, MAPS, clean_mappings, release_compiler

def resident_kb():
    lines, inside, kb = MAPS.read_text().splitlines(), False, 0
    for line in lines:
        if "-" in line.split()[0]:
            inside = LIBRARY in line
        elif inside and line.startswith("Rss:"):
            kb += int(line.split()[1])
    return kb

one = uncached_kernel(lambda x: x + 1)
assert one(1) == 2
before = resident_kb()
release_compiler()
after = resident_kb()
assert after < before / 3, (before, after)
assert one(2) == 3
assert uncached_kernel(lambda x: 2 * x)(2) == 4
"""


def test_what_was_never_written_to_is_given_back() -> None:
    found = [Mapping(0x7F0000000000, 0x200000)]
    assert list(clean_mappings(MAPPING.splitlines(), "libllvmlite")) == found
    assert list(clean_mappings((MAPPING * 2).splitlines(), "libllvmlite")) == found * 2


def test_what_is_another_file_or_was_changed_or_is_locked_stays() -> None:
    for before, after in (
        ("r-xp", "rw-p"),
        ("libllvmlite.so", "libpython3.so"),
        ("Private_Dirty:         0", "Private_Dirty:         4"),
        ("Anonymous:             0", "Anonymous:             4"),
        ("Locked:                0", "Locked:               16"),
    ):
        assert before in MAPPING
        assert not list(clean_mappings(MAPPING.replace(before, after).splitlines(), "libllvmlite"))


def test_kernels_run_and_compile_after_the_compiler_has_given_its_memory_back() -> None:
    subprocess.run([sys.executable, "-c", PROGRAM], check=True, timeout=120)
