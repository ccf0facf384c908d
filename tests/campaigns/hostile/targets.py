"""Fuzz targets: for every parser a function of bytes, which may raise only its declared errors.

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
"""Inputs that a parser once failed on, CRASHES/target/name; every run tries them."""


class Target(NamedTuple):
    """A fuzz target; `run` raises only defects."""

    name: str
    run: Callable[[bytes], None]
    accepts: Callable[[bytes], object]
    """Like `run`, but raises the declared errors too."""
    seeds: Callable[[], Sequence[bytes]]
    """Returns valid inputs."""
    words: tuple[bytes, ...]
    """Inserted by mutations."""
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
    """Decorate a function of bytes as the target of its name."""

    def add(function: Callable[[bytes], object]) -> Callable[[bytes], None]:
        @functools.wraps(function)
        def run(data: bytes) -> None:
            try:
                function(data)
            except declared as error:
                if not str(error).strip():
                    raise AssertionError("an error without a message") from error

        name = function.__name__
        TARGETS[name] = Target(name, run, function, functools.cache(seeds), tuple(words), parser, short)
        return run

    return add


@functools.cache
def folder() -> Path:
    """Return a directory of this process, for parsers of files."""
    directory = tempfile.TemporaryDirectory(prefix="hostile-")
    _DIRECTORIES.append(directory)
    return Path(directory.name)


_DIRECTORIES: list[tempfile.TemporaryDirectory[str]] = []


def file_with(data: bytes, name: str) -> Path:
    """Write a file with this content; return its path."""
    path = folder() / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def crashes_of(name: str) -> list[Path]:
    """Return the inputs that a target once failed on."""
    return sorted((CRASHES / name).glob("*"))
