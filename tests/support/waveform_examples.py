"""A synthetic learned waveform."""

import numpy as np

from servo_ctrl.learning.reversal_waveform import RestForce, WaveformLearned

SAMPLES = 480


def example_waveform(seed: int = 24, samples: int = SAMPLES) -> WaveformLearned:
    """Presliding friction, a smooth force at two accelerations, and one behind two rests."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0.0, np.pi, samples)
    waves = [tuple((level * np.sin(angle) ** 2).tolist()) for level in rng.uniform(0.5, 3.0, 2)]
    return WaveformLearned(
        learner="waveform",
        friction=(3.0, 2.0, 1.0, 0.5, -200.0, 2.0, 0.1),
        accelerations_m_s2=(0.05, 0.4),
        waves_n=tuple(waves),
        before_m=5e-6,
        after_m=1e-7,
        strokes=9,
        machine_time_s=60.0,
        rests=(
            RestForce(0.05, (0.4, 0.7, 0.2, 0.0), (0.0, 0.1, 0.3, 0.0)),
            RestForce(0.5, (1.0, 1.6, 0.5, 0.0), (0.0, 0.3, 0.7, 0.0)),
        ),
    )
