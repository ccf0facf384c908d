"""ISO 230-2 figures against a worked example, the standard library's statistics, and their symmetries."""

import statistics

import numpy as np
import pytest

from servo_ctrl.metrology.iso_230_2 import Positioning, positioning

UM = 1e-6

# two runs of two targets; deviations in um, [run][target][up, down]
WORKED = np.array([[[1.0, -2.0], [4.0, 3.0]], [[3.0, -2.0], [6.0, 1.0]]]) * UM


def some_deviations(runs: int = 5, targets: int = 7) -> np.ndarray:
    return np.random.default_rng(230).normal(0.0, 3.0, (runs, targets, 2)) * UM


def lengths_m(found: Positioning) -> list[float]:
    """The figures that are lengths, whatever the sign and the origin of the deviations."""
    return [
        found.reversal_m,
        found.repeatability_m,
        found.systematic_m,
        found.mean_bidirectional_m,
        found.accuracy_m,
        *found.up,
        *found.down,
    ]


def test_figures_are_those_worked_out_on_paper() -> None:
    # means: 2, -2 and 5, 2; s: sqrt(2), 0 and sqrt(2), sqrt(2)
    found = positioning(WORKED)
    s = 2.0**0.5
    assert found.mean_m / UM == pytest.approx(np.array([[2.0, -2.0], [5.0, 2.0]]))
    assert found.estimator_m / UM == pytest.approx(np.array([[s, 0.0], [s, s]]))
    assert found.reversal_at_m / UM == pytest.approx([4.0, 3.0])
    assert found.reversal_m / UM == pytest.approx(4.0)
    assert found.reversal_mean_m / UM == pytest.approx(3.5)
    assert found.repeatability_at_m / UM == pytest.approx([2 * s + 4.0, 4 * s + 3.0])
    assert found.repeatability_m / UM == pytest.approx(4 * s + 3.0)
    assert found.systematic_m / UM == pytest.approx(7.0)
    assert found.mean_bidirectional_m / UM == pytest.approx(3.5)
    assert found.accuracy_m / UM == pytest.approx(5.0 + 2 * s + 2.0)  # the lowest is -2 with s = 0
    assert np.array(found.up) / UM == pytest.approx([4 * s, 3.0, 3.0 + 4 * s])
    assert np.array(found.down) / UM == pytest.approx([4 * s, 4.0, 4.0 + 2 * s])


def test_means_and_estimators_are_those_of_the_standard_library() -> None:
    deviation_m = some_deviations()
    found = positioning(deviation_m)
    for target in range(deviation_m.shape[1]):
        for direction in (0, 1):
            runs = deviation_m[:, target, direction].tolist()
            assert found.mean_m[target, direction] == pytest.approx(statistics.fmean(runs))
            assert found.estimator_m[target, direction] == pytest.approx(statistics.stdev(runs))


def test_a_shift_of_the_zero_changes_the_means_alone() -> None:
    deviation_m = some_deviations()
    found, shifted = positioning(deviation_m), positioning(deviation_m + 40 * UM)
    assert lengths_m(shifted) == pytest.approx(lengths_m(found))
    assert shifted.mean_m == pytest.approx(found.mean_m + 40 * UM)


def test_a_scale_factor_scales_every_figure() -> None:
    deviation_m = some_deviations()
    assert lengths_m(positioning(3.0 * deviation_m)) == pytest.approx(
        [3.0 * value for value in lengths_m(positioning(deviation_m))]
    )


def test_a_mirrored_axis_has_the_same_figures_with_its_directions_exchanged() -> None:
    deviation_m = some_deviations()
    found, mirrored = positioning(deviation_m), positioning(-deviation_m[:, ::-1, ::-1])
    assert mirrored.up == pytest.approx(found.down)
    assert mirrored.down == pytest.approx(found.up)
    assert mirrored.accuracy_m == pytest.approx(found.accuracy_m)
    assert mirrored.reversal_mean_m == pytest.approx(found.reversal_mean_m)


def test_accuracy_holds_systematic_deviation_and_repeatability() -> None:
    found = positioning(some_deviations())
    assert found.accuracy_m >= found.systematic_m >= max(found.up.systematic_m, found.down.systematic_m)
    assert found.repeatability_m >= max(found.up.repeatability_m, found.down.repeatability_m)
    assert found.mean_bidirectional_m <= found.systematic_m


def test_runs_that_are_alike_leave_the_reversal_as_repeatability() -> None:
    found = positioning(np.repeat(some_deviations(1), 3, axis=0))
    assert found.up.repeatability_m == pytest.approx(0.0, abs=1e-18)
    assert found.repeatability_m == pytest.approx(found.reversal_m)
    assert found.accuracy_m == pytest.approx(found.systematic_m)


@pytest.mark.parametrize(
    ("deviation_m", "reason"),
    [
        (np.zeros((5, 3)), r"\(runs, targets, 2\)"),
        (np.zeros((5, 3, 1)), r"\(runs, targets, 2\)"),
        (np.zeros((1, 3, 2)), "1 runs of 3 targets"),
        (np.zeros((2, 0, 2)), "2 runs of 0 targets"),
        (np.full((2, 1, 2), np.nan), "not finite"),
    ],
)
def test_readings_that_cannot_be_evaluated_are_refused(deviation_m: np.ndarray, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        positioning(deviation_m)
