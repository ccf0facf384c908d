"""The rules' inference against a sampled one written from the paper; the surface against the inference."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from kernels.arrays import Array
from servo_ctrl.control.compensation.fuzzy_inference import SURFACE_POINTS, inferred, surface

VALUES = ["NB", "NM", "NS", "ZO", "PS", "PM", "PB"]
CENTRES = dict(zip(VALUES, np.linspace(-1.0, 1.0, 7), strict=True))
TABLE_I = """
NB NB NB NM NM NS ZO
NB NB NM NM NS ZO PS
NM NM NS NS ZO ZO ZO
NM NM NS ZO PS PM PM
ZO ZO ZO PS PS PM PM
NS ZO PS PM PM PB PB
ZO PS PM PM PB PB PB
"""
RULES = [
    (of_error, of_change, output)
    for of_error, row in zip(VALUES, TABLE_I.split("\n")[1:], strict=False)
    for of_change, output in zip(VALUES, row.split(), strict=True)
]
POINTS = np.random.default_rng(4).uniform(-1.0, 1.0, (60, 2))


def triangle(x: Array, centre: str) -> Array:
    return np.clip(1.0 - 3.0 * np.abs(x - CENTRES[centre]), 0.0, 1.0)


def sampled_inference(error: float, change: float, samples: int = 40_001) -> float:
    y = np.linspace(-4 / 3, 4 / 3, samples)
    union = np.zeros(samples)
    for of_error, of_change, output in RULES:
        met = min(triangle(np.array(error), of_error), triangle(np.array(change), of_change))
        union = np.maximum(union, np.minimum(met, triangle(y, output)))
    return float(np.sum(union * y) / np.sum(union))


def test_the_inference_is_the_centre_of_gravity_of_the_clipped_and_united_outputs() -> None:
    assert len(RULES) == 49
    for error, change in POINTS:
        assert inferred(error, change) == pytest.approx(sampled_inference(error, change), abs=1e-6)


def test_where_both_inputs_are_at_a_centre_the_output_is_that_of_the_printed_rule() -> None:
    for of_error, of_change, output in RULES:
        assert inferred(CENTRES[of_error], CENTRES[of_change]) == pytest.approx(CENTRES[output], abs=1e-12)


def test_inputs_beyond_the_outermost_centres_are_big_and_no_more() -> None:
    for error, change in POINTS:
        assert inferred(np.sign(error) * 7.0, change) == inferred(np.sign(error), change)
        assert inferred(error, np.sign(change) * 1e300) == inferred(error, np.sign(change))


def test_the_other_direction_gives_the_opposite() -> None:
    # the printed table is not symmetric about its diagonal, but it is about its middle
    for error, change in POINTS:
        assert inferred(-error, -change) == pytest.approx(-inferred(error, change), abs=1e-12)


def test_the_interpolated_surface_is_the_inference() -> None:
    nodes = np.linspace(-1.0, 1.0, SURFACE_POINTS)
    lookup = RegularGridInterpolator((nodes, nodes), surface(SURFACE_POINTS))
    # a quarter of a node apart, on the diagonals too, where the inference has its kinks
    fine = np.linspace(-1.0, 1.0, 4 * (SURFACE_POINTS - 1) + 1)
    at = np.stack(np.meshgrid(fine[: len(fine) // 2 + 1 : 1], fine[::3], indexing="ij"), axis=-1).reshape(
        -1, 2
    )
    direct = np.array([inferred(e, de) for e, de in at.tolist()])
    difference = (lookup(at) - direct) / 2.0  # of the span from -1 to 1
    assert np.max(np.abs(difference)) < 0.005
    assert np.sqrt(np.mean(difference**2)) < 0.001


def test_a_surface_whose_nodes_would_miss_the_centres_is_refused() -> None:
    with pytest.raises(ValueError, match="6 k"):
        surface(50)
    with pytest.raises(ValueError, match="6 k"):
        surface(1)
    assert surface(7)[:, 3].tolist() == pytest.approx([-2 / 3, -2 / 3, -1 / 3, 0, 1 / 3, 2 / 3, 2 / 3])


def test_the_surface_has_the_layout_of_the_kernel() -> None:
    found = surface(13)
    assert found.shape == (13, 13)
    assert found.dtype == np.float64
    assert found.flags.c_contiguous
