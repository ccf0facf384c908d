"""A disturbance from outside is one line; what answers to a multisine has the frequencies of that."""

import numpy as np
import pytest
from known_axis import AXIS

from reconcile.catalogue.periodic_disturbance import ENTRY
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data

T, N = 1e-3, 12_000
LINES_HZ = np.arange(5.0, 60.0, 4.0)


def offered_hz(force_hz: float) -> list[float]:
    """Frequencies that are tried where a force has a line beside the inertia of a multisine motion."""
    rng, t = np.random.default_rng(2), np.arange(N) * T
    waves = np.sin(2.0 * np.pi * LINES_HZ[:, None] * t + rng.uniform(0.0, 6.0, (len(LINES_HZ), 1)))
    position_m = np.round((1e-3 / LINES_HZ**1.5) @ waves / 1e-9) * 1e-9
    a = np.gradient(np.gradient(position_m, T), T)
    force_n = 2.0 * a + 0.5 * np.sin(2.0 * np.pi * force_hz * t) + rng.normal(size=N) * 0.01
    recording = AxisRecording("r", "x", T, t, position_m, force_n, None, None, None, {})
    return [shape[0] for shape in ENTRY.terms[0].shapes([regression_data(recording, AXIS)])]


def test_between_the_lines_of_a_multisine_it_is_tried() -> None:
    assert min(abs(hz - 23.3) for hz in offered_hz(23.3)) < 0.05


@pytest.mark.parametrize("force_hz", [5.0, 25.0, 57.0])
def test_at_a_line_of_a_multisine_it_is_not(force_hz: float) -> None:
    assert not any(abs(hz - force_hz) < 0.3 for hz in offered_hz(force_hz))
