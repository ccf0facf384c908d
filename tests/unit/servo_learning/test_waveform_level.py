"""A waveform at another level of friction, against the force of a reversal in closed form."""

from pathlib import Path

import numpy as np
import pytest
from waveform_examples import example_waveform

from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning.reversal_waveform import SLOPES, WaveformLearned
from servo_ctrl.learning.waveform_level import at_level, scaled

LOOP = waveform_settings(load_machine(Path(__file__).parents[3] / "machines" / "xy_table"), "x").loop
SINCE_S = LOOP.period_s * (np.arange(480) - round(LOOP.ahead_s / LOOP.period_s) + LOOP.dead_samples)


def force_n(learned: WaveformLearned, row: int, at_s: np.ndarray) -> np.ndarray:
    """What the law commands around a reversal: presliding friction and waveform."""
    distance_m = 0.5 * learned.accelerations_m_s2[row] * np.maximum(at_s, 0.0) ** 2
    friction_n = [
        level_n * (1.0 - 2.0 * np.exp(-distance_m / slip_m))
        for level_n, slip_m in zip(learned.friction, LOOP.slip_m, strict=False)
    ]
    return np.asarray(np.sum(friction_n, axis=0) + np.interp(at_s, SINCE_S, learned.waves_n[row]))


@pytest.mark.parametrize("share", [0.6, 0.98, 1.5])
def test_friction_changes_by_the_factor_at_the_same_stiffness(share: float) -> None:
    learned = example_waveform()
    changed = at_level(learned, LOOP, share)
    sooner_s = np.where(SINCE_S > 0.0, SINCE_S / np.sqrt(share), SINCE_S)
    for row in (0, 1):
        expected_n = share * force_n(learned, row, sooner_s)
        assert force_n(changed, row, SINCE_S) == pytest.approx(expected_n, abs=1e-3)
    assert changed.friction[-SLOPES:] == learned.friction[-SLOPES:]


def test_the_same_level_is_the_same_waveform() -> None:
    learned = example_waveform()
    assert np.array(at_level(learned, LOOP, 1.0).waves_n) == pytest.approx(
        np.array(learned.waves_n), abs=1e-4
    )
    assert scaled(learned, 1.0) == learned


def test_friction_without_a_waveform_is_only_scaled() -> None:
    bare = example_waveform()._replace(accelerations_m_s2=(), waves_n=())
    assert at_level(bare, LOOP, 0.5) == scaled(bare, 0.5)
