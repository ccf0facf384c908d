"""Fuzz targets: a function of bytes for every parser. It may answer, or raise the error that it declares.

The same functions run under atheris (`fuzz.py`) and, seeded and short, in the tests (`test_targets.py`).
"""

import functools
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[3]
GOLDEN = ROOT / "tests" / "golden" / "formats" / "0.1"
CRASHES = Path(__file__).parent / "crashes"
"""Inputs that a parser once failed on, CRASHES/target/name: they are tried in every run."""


class Target(NamedTuple):
    """`run` raises only what is a defect. `seeds` gives valid inputs, `words` what mutations put in."""

    name: str
    run: Callable[[bytes], None]
    accepts: Callable[[bytes], object]
    """The same, and what is declared is raised too."""
    seeds: Callable[[], Sequence[bytes]]
    words: tuple[bytes, ...]
    parser: str
    """The module whose coverage is reported."""
    short: int
    """Inputs of the short run."""


TARGETS: dict[str, Target] = {}


def target(
    parser: str,
    seeds: Callable[[], Sequence[bytes]],
    *,
    declared: type[Exception] | tuple[type[Exception], ...] = (),
    words: Iterable[bytes] = (),
    short: int = 300,
) -> Callable[[Callable[[bytes], object]], Callable[[bytes], None]]:
    """Make a function of bytes a target called as it is."""

    def add(function: Callable[[bytes], object]) -> Callable[[bytes], None]:
        @functools.wraps(function)
        def run(data: bytes) -> None:
            try:
                function(data)
            except declared as error:
                if not str(error).strip():
                    raise AssertionError("an error without words") from error

        name = function.__name__
        TARGETS[name] = Target(name, run, function, functools.cache(seeds), tuple(words), parser, short)
        return run

    return add


@functools.cache
def folder() -> Path:
    """A directory of this process, for parsers of files."""
    directory = tempfile.TemporaryDirectory(prefix="hostile-")
    _KEPT.append(directory)
    return Path(directory.name)


_KEPT: list[tempfile.TemporaryDirectory[str]] = []


def file_with(data: bytes, name: str) -> Path:
    """A file of this content."""
    path = folder() / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def crashes_of(name: str) -> list[Path]:
    """Inputs that a target once failed on."""
    return sorted((CRASHES / name).glob("*"))
