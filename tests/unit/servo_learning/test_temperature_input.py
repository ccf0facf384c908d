"""Temperatures that are trusted, and those that are not."""

import math

import pytest

from servo_ctrl.learning.temperature_input import (
    AGREEING,
    JUMP_K,
    TemperatureInput,
    after_reading,
    without_reading,
)


def test_the_first_plausible_reading_is_trusted() -> None:
    assert math.isnan(TemperatureInput().degc)
    read = after_reading(TemperatureInput(), 21.5)
    assert (read.degc, read.reason) == (21.5, "")


@pytest.mark.parametrize(
    ("degc", "reason"),
    [
        (-273.1, "-273.1 degC is not within -40 to 150"),
        (850.0, "850 degC is not within"),
        (math.nan, "nan degC is not within"),
    ],
)
def test_an_impossible_temperature_is_rejected_and_the_next_one_is_trusted(degc: float, reason: str) -> None:
    bad = after_reading(after_reading(TemperatureInput(), 21.5), degc)
    assert math.isnan(bad.degc)
    assert bad.reason.startswith(reason)
    assert after_reading(bad, 21.6).degc == 21.6


def test_a_jump_is_trusted_once_the_readings_behind_it_agree() -> None:
    after = after_reading(TemperatureInput(), 21.0)
    for number in range(AGREEING + 1):
        after = after_reading(after, 21.0 + JUMP_K + 1.0 + 0.1 * number)
        assert math.isnan(after.degc) is (number < AGREEING)
        assert (after.reason == "has jumped from 21.0 to 25.0 degC") is (number < AGREEING)
    assert after_reading(after, after.degc + JUMP_K).degc == after.degc + JUMP_K


def test_an_answer_that_failed_leaves_no_temperature() -> None:
    failed = without_reading(after_reading(TemperatureInput(), 21.0), "reading 2012h:00 was not answered")
    assert math.isnan(failed.degc)
    assert failed.reason == "reading 2012h:00 was not answered"
    assert math.isnan(after_reading(failed, 31.0).degc)  # from 21 to 31 degC is a jump all the same
