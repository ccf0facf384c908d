"""Every parser, on mutations of valid inputs (seeded), and on every input that one of them once failed on."""

import gc
import random
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.campaigns.hostile import all_targets
from tests.campaigns.hostile.mutation import mutated
from tests.campaigns.hostile.targets import CRASHES, TARGETS, crashes_of

SEED = 8
pytestmark = [
    pytest.mark.filterwarnings("ignore:The 'warn' method:DeprecationWarning"),  # of canopen's reader of EDS
    pytest.mark.filterwarnings(
        "ignore::pytest.PytestUnraisableExceptionWarning"
    ),  # asammdf leaves half objects
    pytest.mark.filterwarnings("ignore::ResourceWarning"),  # the same
]
NAMES = sorted(TARGETS)
KEPT = [(name, path) for name in NAMES for path in crashes_of(name)]


@pytest.fixture(scope="module", autouse=True)
def half_objects_go_here() -> Iterator[None]:
    """Else they are collected at the end of all tests, where nobody passes over them."""
    yield
    gc.collect()


def test_there_is_a_target_for_every_folder_of_crashes() -> None:
    assert all_targets.MODULES
    assert {path.name for path in CRASHES.iterdir() if path.is_dir()} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_valid_input_is_taken(name: str) -> None:
    """Not refused either: a target whose seeds it refuses would try nothing."""
    target = TARGETS[name]
    for seed in target.seeds():
        target.accepts(seed)


@pytest.mark.parametrize("name", NAMES)
def test_mutations_are_answered_or_refused(name: str) -> None:
    target = TARGETS[name]
    seeds = target.seeds()
    rng = random.Random(SEED ^ zlib.crc32(name.encode()))
    for _ in range(target.short):
        data = mutated(rng.choice(seeds), rng, target.words, seeds)
        try:
            target.run(data)
        except BaseException as error:
            error.add_note(f"{name} on {data[:2000]!r}")
            raise


@pytest.mark.parametrize(("name", "path"), KEPT, ids=[f"{name}-{path.name}" for name, path in KEPT])
def test_former_crashes_are_answered_or_refused(name: str, path: Path) -> None:
    TARGETS[name].run(path.read_bytes())
