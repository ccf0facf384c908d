import math

import pytest

from servo_ctrl.hmi.shell.units import INCH, MM, NO_VALUE, UM, unit_system


def test_an_inch_is_254_tenths_of_a_millimetre_in_every_system() -> None:
    assert MM.length.text(0.0254) == "25.4000"
    assert UM.length.text(0.0254) == "25\N{THIN SPACE}400.0"
    assert INCH.length.text(0.0254) == "1.00000"
    assert INCH.error.text(25.4e-9) == "1"
    assert INCH.feed.text(0.0254 / 60.0) == "1.00"
    assert MM.feed.text(0.001) == "60.0"


def test_negative_numbers_have_a_minus_sign_and_zero_none() -> None:
    assert MM.error.text(-1e-6) == "\N{MINUS SIGN}1.00"
    assert MM.error.text(1e-6, sign=True) == "+1.00"
    assert MM.error.text(-1e-9, sign=True) == "+0.00"


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_an_unknown_value_is_a_dash(value: float | None) -> None:
    assert MM.length.text(value) == MM.length.with_unit(value) == NO_VALUE


@pytest.mark.parametrize("name", [None, "", "furlong", "mm"])
def test_an_unknown_system_is_millimetres(name: str | None) -> None:
    assert unit_system(name) is MM
