"""Friction that drifts in every recording is one thing, friction that is another one in each is not."""

import math
from pathlib import Path

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.explain import Explanation, explain
from reconcile.identification.term_search import TermSearch
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.selection.selection_rules import SelectionRules
from reconcile.sensing.checks import examine

T, N = 1e-3, 12_000
LEVELS_N = (3.0, 1.5, 0.0)


def explained(tmp_path: Path, drift_n: float) -> Explanation:
    """Of three recordings whose friction has levels of its own, and drifts within each."""
    (tmp_path / "nominal.toml").write_text(WITHOUT_SCALE, encoding="utf-8")
    model = load_model(tmp_path / "nominal.toml")
    rng, t, files = np.random.default_rng(2), np.arange(N) * T, []
    for number, level_n in enumerate(LEVELS_N):
        x = 0.02 * np.sin(2.0 * math.pi * (0.31 + 0.05 * number) * t) + 0.008 * np.sin(7.1 * t + number)
        v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
        friction_n = 12.0 + level_n + drift_n * np.exp(-t / 8.0)
        force = 50.0 * a + 100.0 * v + friction_n * np.sign(v) + rng.normal(size=N) * 0.3
        files.append(tmp_path / f"r{number}.csv")
        columns = np.stack((t, np.round(x / 5e-9) * 5e-9, force), axis=1)
        header = "time_s,motor_position_m,motor_force_n"
        np.savetxt(files[-1], columns, delimiter=",", comments="", header=header)
    recordings = examine(load_recordings(files, model.axes), model.axes).recordings
    return explain(TermSearch(recordings, model.axes["x"], ResidualChannel.FORCE, SelectionRules()))


@pytest.mark.parametrize(("drift_n", "expected"), [(2.0, True), (0.0, False)])
def test_only_what_changes_within_a_recording_is_a_drift(
    tmp_path: Path, drift_n: float, *, expected: bool
) -> None:
    named = {finding.effect for finding in explained(tmp_path, drift_n).findings}
    assert ("temperature_dependent_friction" in named) is expected


def test_friction_that_all_recordings_have_is_no_part_of_their_own_levels(tmp_path: Path) -> None:
    drift_n = 2.0
    found = explained(tmp_path, drift_n)
    assert found.base["coulomb_n"] == pytest.approx(12.0 + np.mean(LEVELS_N) + drift_n, rel=0.05)
    assert found.base["viscous_n_s_m"] == pytest.approx(100.0, rel=0.1)
