"""The error text of any library becomes one line."""

import pytest

from servo_ctrl.errors import first_line


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ValueError("no number in row 3\nHint: ..."), "no number in row 3"),
        (ValueError(), "ValueError()"),
        (KeyError("x"), "'x'"),
    ],
)
def test_error_text_is_its_first_line_or_its_type(error: Exception, text: str) -> None:
    assert first_line(error) == text
