"""Values that learning exchanges with the daemon or the batch twin, which make the strokes. SI units."""

import math
from typing import NamedTuple

from kernels.arrays import Array


class Pulse(NamedTuple):
    """The friction compensation pulse of one reversal, as `PulseShape` of the control law describes it."""

    duration_s: float = 0.0
    amplitude_m_s: float = 0.0
    trailing_start_s: float = 0.0
    trailing_duration_s: float = 0.0
    trailing_amplitude_m_s: float = 0.0


NO_PULSE = Pulse()


class Stroke(NamedTuple):
    """One sine motion that learning requests: radius R from the settings, reverse acceleration and pulse."""

    stage: str
    """Purpose: "interval", "duration", "coarse", "fine", "search", "trailing", "check"; of
    waveforms: "identify", "waveform", "rest", "check"."""
    acceleration_m_s2: float
    pulse: Pulse
    rest_s: float = 0.0
    """Above 0: moves with rests of this duration between them instead of a sine."""


class StrokeResult(NamedTuple):
    """Errors of one stroke after its reversals."""

    error_m: Array
    """(reversals, samples) from t1 on, positive where the axis lags behind its new direction; whole nm."""
    period_s: float


class LearningSettings(NamedTuple):
    """Learning settings of one axis; [learning] and [axis.NAME.friction_compensation] in SI."""

    learner: str
    """"paper" or "fast"."""
    accelerations_m_s2: tuple[float, float, float, float]
    """a_min, a_1, a_2, a_max."""
    steps: tuple[int, int, int]
    """N_1, N_2, N_3."""
    coarse_steps: int
    fine_steps: int
    initial_share: float
    """k of A_0 = k A_max."""
    duration_step_s: float
    duration_reach: float
    window_durations: float
    trailing: bool
    radius_m: float
    amplitude_max_m_s: float
    rise_s: float
    window_s: float
    """Monitoring time Tm of production."""


class Learned(NamedTuple):
    """The learned functions of one axis."""

    learner: str
    durations: tuple[tuple[float, float], ...]
    """(reverse acceleration, duration T*), rising; linear in between."""
    amplitudes: tuple[tuple[float, float], ...]
    """(reverse acceleration, amplitude A*), rising."""
    spread_m_s2: float
    """s of the GRNN over `amplitudes`; 0 = the amplitudes are joined by lines instead."""
    trailing: tuple[tuple[float, float, float, float], ...] = ()
    """(reverse acceleration, start, duration, amplitude) of the second trapezoid, rising; may be empty."""
    before_m: float = math.nan
    """J without compensation, mean over the checked accelerations."""
    after_m: float = math.nan
    """J with the learned functions, likewise."""
    strokes: int = 0
    machine_time_s: float = 0.0


class Outlook(NamedTuple):
    """Progress of a learning run."""

    stage: str
    strokes_done: int
    strokes_total: int
    """Expected. Exact for the paper's sweeps once their intervals are known; other stages may end early."""
    remaining_s: float
    """Expected machine time of the remaining strokes."""
    acceleration_m_s2: float = math.nan
    best_m: float = math.nan
    """Least J so far at this acceleration, NaN before the first."""


class ReversalReport(NamedTuple):
    """The indicators of one reversal in production; metres."""

    cycle: int
    """SYNC cycle of t1."""
    direction: int
    """Direction of motion after the reversal: +1 or -1."""
    acceleration_m_s2: float
    """Reverse acceleration, positive."""
    contour_peak_m: float
    error_peak_m: float
    error_rms_m: float
    error_mean_m: float
    """Mean |e|: the evaluation J."""
