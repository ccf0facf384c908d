"""The memory of presliding against springs that slip one by one."""

import itertools

import numpy as np
import pytest

from kernels.arrays import Array
from servo_ctrl.control.presliding_memory import (
    NO_TURN,
    Turn,
    relaxed_at,
    slip_travel_m,
    turned,
    without_closed_loop,
)

STEP_M = 1e-6
BREAKAWAYS_M = np.geomspace(3e-6, 400e-6, 60)


def path_through(turns_um: list[float]) -> Array:
    """Positions (n,) from 0 through these turns, one step each."""
    ends = np.round(np.array([0.0, *turns_um]) * 1e-6 / STEP_M).astype(int)
    legs = [np.arange(a, b, np.sign(b - a)) for a, b in itertools.pairwise(ends)]
    return np.concatenate([*legs, ends[-1:]]) * STEP_M


def travels_m(path_m: Array) -> Array:
    """The travel with as much slip, (n,), of the law."""
    branch, direction, found = relaxed_at(path_m[0]), 0.0, [0.0]
    for before_m, position_m in zip(path_m[:-1].tolist(), path_m[1:].tolist(), strict=True):
        now = float(np.sign(position_m - before_m))
        if now * direction < 0.0:
            branch = turned(branch, Turn(before_m, 0.0))
        else:
            branch = without_closed_loop(branch, position_m, now)
        direction = now
        found.append(slip_travel_m(branch, position_m, direction))
    return np.array(found)


def slipping(path_m: Array) -> np.ndarray:
    """Which of the springs slip, (n, springs): each is drawn along at its breakaway displacement."""
    stretch_m, found = np.zeros(len(BREAKAWAYS_M)), [np.zeros(len(BREAKAWAYS_M), dtype=bool)]
    for step_m in np.diff(path_m):
        stretch_m = stretch_m + step_m
        found.append(np.abs(stretch_m) >= BREAKAWAYS_M)
        stretch_m = np.clip(stretch_m, -BREAKAWAYS_M, BREAKAWAYS_M)
    return np.array(found)


def agreement(path_m: Array) -> float:
    """Share of springs and samples of which the law says rightly whether they slip, off its edge."""
    found_m = travels_m(path_m)[:, np.newaxis]
    assert np.isfinite(found_m).all()
    edge = np.abs(2.0 * BREAKAWAYS_M - found_m) < 4.0 * STEP_M
    return float(((found_m > 2.0 * BREAKAWAYS_M) == slipping(path_m))[~edge].mean())


@pytest.mark.parametrize(
    "turns_um",
    [
        [3000.0],
        [3000.0, -3000.0],
        [34.0, -3000.0],
        [130.0, -60.0, 500.0],
        [900.0, 700.0, 790.0, 0.0],
        [900.0, 850.0, 3000.0],
        [60.0, -20.0, 30.0, -900.0],
    ],
)
def test_as_many_springs_slip_as_the_travel_says(turns_um: list[float]) -> None:
    path_m = path_through(turns_um)
    assert agreement(path_m) > 0.995  # a loop closes within a step or two


@pytest.mark.parametrize("seed", range(8))
def test_so_it_is_on_random_paths_of_five_open_loops_at_most(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths_um = 1000.0 * np.cumprod(rng.uniform(0.3, 0.9, 5)) * np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    turns_um = np.cumsum([*lengths_um, -5000.0])
    path_m = path_through(turns_um.tolist())
    assert agreement(path_m) > 0.995


def test_behind_a_long_motion_it_is_the_travel_since_the_reversal() -> None:
    path_m = path_through([2000.0, -1999.0])
    behind = slice(2001, None)
    assert travels_m(path_m)[behind] == pytest.approx(2000e-6 - path_m[behind], abs=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_behind_more_loops_than_are_remembered_it_is_right_again_when_they_have_closed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths_um = 2000.0 * np.cumprod(np.array([1.0, *rng.uniform(0.3, 0.9, 2 * rng.integers(3, 5))]))
    turns_um = np.cumsum(lengths_um * np.resize([1.0, -1.0], len(lengths_um))).tolist()
    path_m = path_through([*turns_um, -1900.0])
    closed = np.arange(len(path_m)) >= len(path_through(turns_um))
    closed &= path_m < 1e-6 * turns_um[1] - 2.0 * STEP_M
    assert closed.any()
    assert travels_m(path_m)[closed] == pytest.approx(1e-6 * turns_um[0] - path_m[closed], abs=STEP_M)


def test_with_a_sixth_reversal_the_innermost_loop_is_forgotten() -> None:
    turns = [Turn(turn_m, 1e6 * turn_m) for turn_m in (60e-6, -50e-6, 40e-6, -30e-6, 20e-6, -10e-6)]
    branch = relaxed_at(0.0)
    for turn in turns:
        branch = turned(branch, turn)
    assert branch == (0.0, turns[5], turns[2], turns[1], turns[0], NO_TURN)
    assert slip_travel_m(branch, -5e-6, 1.0) == pytest.approx(5e-6)
    opened = without_closed_loop(branch, 41e-6, 1.0)
    assert slip_travel_m(opened, 41e-6, 1.0) == pytest.approx(91e-6)
    assert opened.turn_1.held_n == pytest.approx(-50.0)
