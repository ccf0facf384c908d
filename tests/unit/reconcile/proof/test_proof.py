"""Which of two models predicts left-out recordings better, with and without their standard error."""

import pytest

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.proof.proof import HeldOutErrors, Proof


def proof(*errors_n: float) -> Proof:
    """A model with this error in each recording."""
    parts = [
        HeldOutErrors(f"{number}.csv", ResidualChannel.FORCE, 1000, measured=9.0, rigid=5.0, written=error_n)
        for number, error_n in enumerate(errors_n)
    ]
    return Proof(ResidualChannel.FORCE, parts, is_last_third=len(parts) == 1)


@pytest.mark.parametrize(
    ("model", "other", "is_better"),
    [
        ((1.2, 1.0), (1.0, 1.6), False),  # a weight of one pose helps in one recording only
        ((0.9, 1.0), (1.0, 1.6), True),
        ((1.0, 1.0), (1.0, 1.6), True),  # one recording is predicted alike
        ((1.01, 0.5, 0.5, 0.5), (1.0, 1.0, 1.0, 1.0), True),  # one of many may be predicted worse
        ((1.5, 1.4, 1.5, 0.1), (1.0, 1.0, 1.0, 3.0), False),  # one alone does not decide
        ((0.9,), (1.0,), True),  # of one recording there is no standard error
    ],
)
def test_a_force_over_the_position_holds_from_one_recording_to_the_next(
    model: tuple[float, ...], other: tuple[float, ...], is_better: bool
) -> None:
    assert proof(*model).is_better_than(proof(*other), by_standard_error=True) == is_better
    assert proof(*model).is_better_than(proof(*other))


def test_two_per_cent_less_are_needed() -> None:
    assert not proof(0.99, 0.99).is_better_than(proof(1.0, 1.0))
    assert not proof(0.99, 0.99).is_better_than(proof(1.0, 1.0), by_standard_error=True)
