"""Whether a rival puts a name in doubt, or is of one class with it."""

import pytest

from reconcile.identification.rivals import RivalEffect, largest_doubt


@pytest.mark.parametrize(
    ("confidence", "share", "doubt"),
    [
        (0.99, 1.01, 0.0),
        (0.3, 0.96, 0.0),
        (0.3, 0.8, 0.3),
        (0.94, 1.42, 0.94),
        (0.01, 1.0, 0.01),
        (0.0, 0.5, 0.0),
    ],
    ids=[
        "as much, and not to be told from it",
        "nearly as much",
        "less",
        "more: it is the better name",
        "as much, but told from it block by block",
        "no rival",
    ],
)
def test_a_name_is_in_doubt_by_effects_outside_its_class_alone(
    confidence: float, share: float, doubt: float
) -> None:
    assert largest_doubt([RivalEffect("gravity", confidence, share)]) == doubt


def test_the_most_probable_rival_makes_the_doubt() -> None:
    rivals = [
        RivalEffect("gravity", 0.9, 1.0),
        RivalEffect("cogging", 0.2, 0.5),
        RivalEffect("backlash", 0.1, 0.4),
    ]
    assert largest_doubt(rivals) == 0.2
    assert largest_doubt([]) == 0.0


def test_an_unnamed_term_is_in_doubt_by_a_name_that_explains_as_much() -> None:
    assert largest_doubt([RivalEffect("cogging", 0.9, 1.0)], unnamed=True) == 0.9
