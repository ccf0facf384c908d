"""The frequency of a disturbance lies between the points of a transform, and is told with its uncertainty."""

import math
from pathlib import Path

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.explain import explain
from reconcile.identification.term_search import TermSearch
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.selection.selection_rules import SelectionRules
from reconcile.sensing.checks import examine

T, N = 1e-3, 12_000
AMPLITUDE_N = 2.0


@pytest.mark.parametrize("seed", range(2))
def test_interval_of_frequency_and_amplitude_hold_the_truth(tmp_path: Path, seed: int) -> None:
    (tmp_path / "nominal.toml").write_text(WITHOUT_SCALE, encoding="utf-8")
    model = load_model(tmp_path / "nominal.toml")
    rng, t = np.random.default_rng(seed), np.arange(N) * T
    true_hz = (rng.integers(100, 400) + 0.5) / (4.0 * N * T)  # half way between two points of the transform
    x = 0.02 * np.sin(2.0 * math.pi * 0.31 * t) + 0.008 * np.sin(7.1 * t + seed)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    wave_n = AMPLITUDE_N * np.sin(2.0 * math.pi * true_hz * t + rng.uniform(0.0, 6.0))
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + wave_n + rng.normal(size=N)
    columns = np.stack((t, np.round(x / 5e-9) * 5e-9, force), axis=1)
    header = "time_s,motor_position_m,motor_force_n"
    np.savetxt(tmp_path / "r.csv", columns, delimiter=",", comments="", header=header)
    recordings = examine(load_recordings([tmp_path / "r.csv"], model.axes), model.axes).recordings
    found = explain(TermSearch(recordings, model.axes["x"], ResidualChannel.FORCE, SelectionRules()))
    [wave] = [one for one in found.findings if one.effect == "periodic_disturbance"]
    frequency, amplitude = wave.parameters["frequency_hz"], wave.parameters["amplitude"]
    assert frequency.low < true_hz < frequency.high
    assert frequency.high - frequency.low < 0.3 / (N * T)
    assert amplitude.low < AMPLITUDE_N < amplitude.high
    assert amplitude.value == pytest.approx(AMPLITUDE_N, rel=0.03)
