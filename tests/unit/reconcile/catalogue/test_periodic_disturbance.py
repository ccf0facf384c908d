"""A disturbance from outside is one line; what answers to a multisine has the frequencies of that."""

import numpy as np
import pytest
from known_axis import AXIS

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData
from reconcile.catalogue.periodic_disturbance import ENTRY
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data

T, N = 1e-3, 12_000
LINES_HZ = np.arange(5.0, 60.0, 4.0)


def multisine(force_hz: float, lines_hz: Array = LINES_HZ, size_n: float = 0.5) -> RegressionData:
    """A force has a line beside the inertia of a motion that is made of lines."""
    rng, t = np.random.default_rng(2), np.arange(N) * T
    waves = np.sin(2.0 * np.pi * lines_hz[:, None] * t + rng.uniform(0.0, 6.0, (len(lines_hz), 1)))
    position_m = np.round((1e-3 / lines_hz**1.5) @ waves / 1e-9) * 1e-9
    a = np.gradient(np.gradient(position_m, T), T)
    force_n = 2.0 * a + size_n * np.sin(2.0 * np.pi * force_hz * t) + rng.normal(size=N) * 0.01
    return regression_data(AxisRecording("r", "x", T, t, position_m, force_n, None, None, None, {}), AXIS)


def offered_hz(force_hz: float) -> list[float]:
    """Frequencies that are tried in one recording."""
    return [shape[0] for shape in ENTRY.terms[0].shapes([multisine(force_hz)])]


def test_between_the_lines_of_a_multisine_it_is_tried() -> None:
    assert min(abs(hz - 23.3) for hz in offered_hz(23.3)) < 0.05


@pytest.mark.parametrize("force_hz", [5.0, 25.0, 57.0])
def test_at_a_line_of_a_multisine_it_is_not(force_hz: float) -> None:
    assert not any(abs(hz - force_hz) < 0.3 for hz in offered_hz(force_hz))


@pytest.mark.parametrize(("size_n", "is_tried"), [(0.5, True), (0.0, False)])
def test_at_a_line_of_one_motion_it_is_where_another_motion_without_it_has_the_force(
    size_n: float, is_tried: bool
) -> None:
    slow = multisine(25.0, np.array([0.7, 1.9, 3.1]), size_n)
    offered = ENTRY.terms[0].shapes([multisine(25.0), slow])
    assert any(abs(shape[0] - 25.0) < 0.1 for shape in offered) == is_tried


def test_in_a_scan_that_repeats_a_line_that_stands_alone_is_tried() -> None:
    """The harmonics of its turns are a comb through all frequencies, of little power each."""
    t = np.arange(N) * T
    position_m = (
        np.round(0.05 * np.cumsum(np.clip(3.0 * np.sin(2.0 * np.pi * 0.4 * t), -1.0, 1.0)) * T / 1e-9) * 1e-9
    )
    force_n = 2.0 * np.gradient(np.gradient(position_m, T), T) + 0.5 * np.sin(2.0 * np.pi * 9.6 * t)
    force_n += np.random.default_rng(3).normal(size=N) * 0.05
    recording = AxisRecording("r", "x", T, t, position_m, force_n, None, None, None, {})
    offered = ENTRY.terms[0].shapes([regression_data(recording, AXIS)])
    assert any(abs(shape[0] - 9.6) < 0.1 for shape in offered)


def test_a_frequency_between_the_points_of_the_transform_is_tried() -> None:
    between_hz = (4 * 280 + 0.5) / (4.0 * N * T)
    assert min(abs(hz - between_hz) for hz in offered_hz(between_hz)) < 0.02 / (N * T)
