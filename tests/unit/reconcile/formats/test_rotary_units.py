"""Sentences and units of a rotary axis: newton metres and radians, from the same numbers."""

import pytest

from reconcile.formats.rotary_units import in_units_of, sentence_of

SENTENCES = {
    "12.5 N are left at 3 mm/s": "12.5 N m are left at 3 mrad/s",
    "lags by 0.2 um per newton of force (stiffness 4 N/um)": (
        "lags by 0.2 urad per newton metre of force (stiffness 4 N m/urad)"
    ),
    "0.5 kg on a spring of 528 N/m": "0.5 kg m^2 on a spring of 528 N m/rad",
    "moves by 1.1 m per metre of motor_m": "moves by 1.1 rad per radian of motor_m",
    "a torque of 3 N m, 4 newton metres": "a torque of 3 N m, 4 newton metres",
    "3 samples in motion at 54 Hz, 5 ms late": "3 samples in motion at 54 Hz, 5 ms late",
}


@pytest.mark.parametrize("linear", SENTENCES)
def test_units_of_a_sentence_change_and_numbers_do_not(linear: str) -> None:
    assert sentence_of(linear, rotary=False) == linear
    assert sentence_of(linear, rotary=True) == SENTENCES[linear]


def test_units_are_those_of_keys_that_end_so() -> None:
    entry = {"unit": "m", "peak_unit": "N", "effect": "cogging", "parts": [{"unit": "N s/m", "value": 1.0}]}
    found = in_units_of(entry, rotary=True)
    assert found == {
        "unit": "rad",
        "peak_unit": "N m",
        "effect": "cogging",
        "parts": [{"unit": "N m s/rad", "value": 1.0}],
    }
