"""Which blocks are held out: every fourth stretch, of several short recordings counted together."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from reconcile.identification.held_out_blocks import training_and_held_out


def divided(*blocks_of_recordings: int, empty: tuple[int, ...] = ()) -> tuple[list[int], list[int]]:
    of = np.repeat(np.arange(len(blocks_of_recordings)), blocks_of_recordings)
    samples = np.where(np.isin(np.arange(len(of)), empty), 0, 250)
    equations = SimpleNamespace(recordings=len(blocks_of_recordings), recording_of_block=of, samples=samples)
    problem: Any = SimpleNamespace(equations=equations)
    train, held_out = training_and_held_out(problem)
    return train.tolist(), held_out.tolist()


def test_of_a_long_recording_every_fourth_stretch_is_held_out() -> None:
    train, held_out = divided(33)
    assert held_out == [*range(12, 16), *range(28, 32)]
    assert sorted(train + held_out) == list(range(33))


def test_a_short_recording_alone_is_fitted_whole() -> None:
    assert divided(12) == (list(range(12)), [])


def test_short_recordings_count_their_stretches_together() -> None:
    """Of 3, 2 and 3 stretches the fourth and the eighth are held out, and none spans two recordings."""
    _, held_out = divided(10, 8, 11)
    assert held_out == [*range(10, 14), *range(26, 29)]


def test_a_short_recording_beside_a_long_one_is_fitted_whole() -> None:
    _, held_out = divided(16, 9)
    assert held_out == list(range(12, 16))


@pytest.mark.parametrize("rest", [(5,), (0, 1, 2)])
def test_blocks_without_a_sample_are_in_neither(rest: tuple[int, ...]) -> None:
    train, held_out = divided(20, empty=rest)
    assert not {*rest} & {*train, *held_out}
    assert len(train) + len(held_out) == 20 - len(rest)
