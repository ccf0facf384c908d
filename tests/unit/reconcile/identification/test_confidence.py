"""How sure a name is, against the logistic curve written out by hand."""

import math

import pytest

from reconcile.identification.confidence import (
    GAIN_MARGIN,
    INTERCEPT,
    SLOPE,
    confidence,
    largest_confidence,
    true_share,
)


def test_half_of_the_held_out_variance_has_the_level_of_the_curve() -> None:
    assert true_share(0.5) == pytest.approx(1.0 / (1.0 + math.exp(-INTERCEPT)))


@pytest.mark.parametrize("gain", [0.01, 0.2, 0.8, 0.99])
def test_log_odds_are_a_line_over_the_log_odds_of_the_gain(gain: float) -> None:
    share = true_share(gain)
    assert math.log(share / (1.0 - share)) == pytest.approx(INTERCEPT + SLOPE * math.log(gain / (1.0 - gain)))


def test_a_gain_beyond_the_fitted_range_is_as_its_end() -> None:
    assert true_share(-1.0) == true_share(0.0) == true_share(GAIN_MARGIN)
    assert true_share(1.0) == true_share(2.0) == true_share(1.0 - GAIN_MARGIN)


def test_a_rival_takes_its_probability_away() -> None:
    assert confidence(0.0, 0.3) == true_share(0.3)
    assert confidence(0.25, 0.3) == pytest.approx(0.75 * true_share(0.3))
    assert confidence(1.0, 0.3) == 0.0


def test_seconds_of_data_give_no_certainty_and_minutes_do() -> None:
    assert largest_confidence(0.0) == 0.5
    assert confidence(0.0, 0.999, 0.25 * 3.0) == pytest.approx(1.0 - 1.0 / 17.0)
    assert confidence(0.0, 0.999, 0.25 * 100.0) > 0.99
    assert confidence(0.0, 0.1, 25.0) == true_share(0.1)
