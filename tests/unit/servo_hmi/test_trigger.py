"""The trigger against a loop over all rows, however the rows are cut into blocks."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from servo_ctrl.hmi.scope.trigger import Trigger, TriggerState, find_triggers
from servo_ctrl.learning.performance import reversals

VALUES = st.lists(st.integers(-2, 2).map(float) | st.just(math.nan), max_size=40)
CUTS = st.lists(st.integers(0, 40), max_size=4).map(sorted)


def in_blocks(trigger: Trigger, values: list[float], cuts: list[int]) -> list[int]:
    rows = np.column_stack((np.zeros(len(values)), np.array(values, dtype=np.float64)))
    state, found = TriggerState(), []
    for begin, end in zip([0, *cuts], [*cuts, len(rows)], strict=True):
        state, places = find_triggers(trigger, state, rows[begin:end])
        found += (places + begin).tolist()
    return found


@settings(max_examples=150)
@given(VALUES, CUTS)
def test_a_rising_level_triggers_at_the_first_value_at_or_above_it(
    values: list[float], cuts: list[int]
) -> None:
    expected, last = [], math.nan
    for place, value in enumerate(values):
        if math.isnan(value):
            continue
        if last < 0.5 <= value:
            expected.append(place)
        last = value
    cuts = [min(cut, len(values)) for cut in cuts]
    assert in_blocks(Trigger("rising", (1,), 0.5), values, cuts) == expected


@settings(max_examples=150)
@given(VALUES, CUTS, st.sampled_from([0.0, 0.5, 1.0, 2.0]))
def test_with_hysteresis_a_level_triggers_again_only_after_leaving_it(
    values: list[float], cuts: list[int], hysteresis: float
) -> None:
    expected, armed = [], False
    for place, value in enumerate(values):
        if value >= 0.5:
            if armed:
                expected.append(place)
            armed = False
        elif value < 0.5 - hysteresis:
            armed = True
    cuts = [min(cut, len(values)) for cut in cuts]
    assert in_blocks(Trigger("rising", (1,), 0.5, hysteresis), values, cuts) == expected
    turned = [-value for value in values]
    assert in_blocks(Trigger("falling", (1,), -0.5, hysteresis), turned, cuts) == expected


def test_noise_at_the_level_triggers_once_with_hysteresis() -> None:
    noise = np.random.default_rng(5).normal(size=4000) * 0.02
    values = (np.sin(np.linspace(-0.5, 4.0 * np.pi - 0.5, 4000)) + noise).tolist()
    assert len(in_blocks(Trigger("rising", (1,), 0.0), values, [])) > 5
    assert len(in_blocks(Trigger("rising", (1,), 0.0, 0.2), values, [])) == 2


@settings(max_examples=150)
@given(VALUES, CUTS)
def test_a_falling_level_mirrors_a_rising_one(values: list[float], cuts: list[int]) -> None:
    cuts = [min(cut, len(values)) for cut in cuts]
    turned = [-value for value in values]
    falling = in_blocks(Trigger("falling", (1,), -1.0), turned, cuts)
    assert falling == in_blocks(Trigger("rising", (1,), 1.0), values, cuts)


@settings(max_examples=150)
@given(VALUES, CUTS)
def test_reversals_are_those_of_the_indicators_and_a_gap_makes_none(
    values: list[float], cuts: list[int]
) -> None:
    numbers = [place for place, value in enumerate(values) if not math.isnan(value)]
    whole = reversals(np.array([values[place] for place in numbers]))
    cuts = [min(cut, len(values)) for cut in cuts]
    assert in_blocks(Trigger("reversal", (1,)), values, cuts) == [numbers[place] for place in whole]


@pytest.mark.parametrize("cut", range(7))
def test_a_fault_triggers_once_when_the_first_drive_reports_it(cut: int) -> None:
    healthy, fault = 0x1237, 0x1208
    left = [healthy, healthy, fault, fault, healthy, fault]
    right = [healthy, healthy, healthy, fault, healthy, math.nan]
    rows = np.array([left, right], dtype=np.float64).T
    trigger = Trigger("fault", (0, 1))
    state, first = find_triggers(trigger, TriggerState(), rows[:cut])
    _, second = find_triggers(trigger, state, rows[cut:])
    assert first.tolist() + (second + cut).tolist() == [2, 5]


def test_free_running_never_triggers() -> None:
    assert in_blocks(Trigger(), [0.0, 1.0, -1.0], []) == []
