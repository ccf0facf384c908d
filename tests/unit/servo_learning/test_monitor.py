"""When learning is due, and the window of a reversal against hand calculation."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.learning.monitor import (
    SETTLED,
    DueRule,
    DueState,
    Window,
    across_m,
    evaluated,
    next_due_state,
)

REQUIRED_M = 4e-6
SETTLED_BELOW = 0.9
EVALUATION_M = {"bad": 4.5e-6, "between": 3.8e-6, "good": 3e-6}
REVERSALS = st.lists(st.sampled_from(sorted(EVALUATION_M)), max_size=60)


def rule(reversals: int) -> DueRule:
    return DueRule(REQUIRED_M, SETTLED_BELOW, reversals)


def history(reversals: int, kinds: list[str]) -> list[bool]:
    """Whether learning is due after each."""
    states = itertools.accumulate(
        (EVALUATION_M[kind] for kind in kinds),
        lambda state, evaluation_m: next_due_state(rule(reversals), state, evaluation_m),
        initial=SETTLED,
    )
    return [state.due for state in states][1:]


def by_text(reversals: int, kinds: list[str]) -> list[bool]:
    """The same, by looking for so many equal letters in a row, in turn."""
    text, place, found, due = "".join(kind[1] for kind in kinds), 0, [False] * len(kinds), False
    while (at := text.find(("o" if due else "a") * reversals, place)) >= 0:
        place, due = at + reversals, not due
        found[place - 1 :] = [due] * (len(found) - place + 1)
    return found


@given(st.integers(min_value=1, max_value=6), REVERSALS)
def test_learning_is_due_after_so_many_bad_reversals_in_a_row_until_as_many_good_ones(
    reversals: int, kinds: list[str]
) -> None:
    assert history(reversals, kinds) == by_text(reversals, kinds)


@given(st.integers(min_value=2, max_value=6), REVERSALS)
def test_a_single_bad_reversal_never_makes_learning_due(reversals: int, kinds: list[str]) -> None:
    alone = [kind if i % 2 else "good" for i, kind in enumerate(kinds)]
    assert not any(history(reversals, alone))


@given(
    st.integers(min_value=1, max_value=6),
    st.booleans(),
    st.lists(st.floats(min_value=SETTLED_BELOW * REQUIRED_M, max_value=REQUIRED_M), max_size=60),
)
def test_between_the_two_limits_nothing_changes(
    reversals: int, due: bool, evaluations_m: list[float]
) -> None:
    state = DueState(due, 0)
    for evaluation_m in evaluations_m:
        state = next_due_state(rule(reversals), state, evaluation_m)
        assert state == (due, 0)


def test_j_alternating_about_the_requirement_does_not_toggle_learning_due() -> None:
    changes = [a != b for a, b in itertools.pairwise(history(4, ["bad"] * 4 + ["bad", "between"] * 50))]
    assert changes.count(True) == 1


def filled(error_m: list[float], contour_m: list[float], direction: int, *, other_moves: bool) -> Window:
    window = Window(cycle=70, direction=direction, acceleration_m_s2=0.1)
    counts = [
        window.add(e, c, other_moves=other_moves and i == 1)
        for i, (e, c) in enumerate(zip(error_m, contour_m, strict=True))
    ]
    assert counts == list(range(1, len(error_m) + 1))
    return window


def test_indicators_of_a_window_equal_a_hand_calculation() -> None:
    found = evaluated(filled([3e-6, -4e-6], [-2e-6, 1e-6], -1, other_moves=True))
    assert found is not None
    report, trace_m = found
    assert report == (70, -1, 0.1, 2e-6, 4e-6, pytest.approx(math.sqrt(12.5) * 1e-6), 3.5e-6)
    assert trace_m.tolist() == [-3e-6, 4e-6], "towards the new direction the table lags by the second only"


def test_without_another_axis_that_moves_the_contour_error_is_the_tracking_error() -> None:
    found = evaluated(filled([3e-6, -4e-6], [-2e-6, 1e-6], 1, other_moves=False))
    assert found is not None
    assert found[0].contour_peak_m == found[0].error_peak_m == 4e-6


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_window_with_a_sample_that_is_no_number_is_not_evaluated(bad: float) -> None:
    assert evaluated(filled([1e-6, bad], [0.0, 0.0], 1, other_moves=False)) is None
    assert evaluated(filled([1e-6, 1e-6], [0.0, bad], 1, other_moves=True)) is None
    assert evaluated(filled([1e-6, 1e-6], [0.0, bad], 1, other_moves=False)) is not None
    window = filled([1e-6, 1e-6], [0.0, 0.0], 1, other_moves=False)
    window.acceleration_m_s2 = bad
    assert evaluated(window) is None


def test_across_is_normal_to_the_step_and_left_positive() -> None:
    assert across_m((0.0, 2.0), (-3.0, 5.0)) == 3.0
    assert across_m((-3.0, -4.0), (-3.0, -4.0)) == 0.0
    assert across_m((1.0, 1.0), (1.0, -1.0)) == pytest.approx(-math.sqrt(2.0))
