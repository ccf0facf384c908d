"""The second trapezoid on top of the paper's functions, on an axis where it is known."""

import numpy as np
from synthetic_axes import SETTINGS, LinearAxis, follow

from servo_ctrl.learning import fast
from servo_ctrl.learning.fast import learn_trailing
from servo_ctrl.learning.pulse_functions import pulse_at
from servo_ctrl.learning.stroke_result import evaluation_m
from servo_ctrl.learning.types import NO_PULSE, Learned, Pulse, Stroke

DURATION_S, AMPLITUDE_M_S = 0.08, 0.0008
LEARNED = Learned(
    "paper", ((0.002, DURATION_S), (0.12, DURATION_S)), ((0.002, AMPLITUDE_M_S), (0.12, AMPLITUDE_M_S)),
    0.01, (), 0.0, 0.0, 0, 0.0,
)  # fmt: skip
BEST = Pulse(DURATION_S, AMPLITUDE_M_S, 0.12, 0.06, -0.0003)


def test_the_second_trapezoid_removes_the_overshoot_of_the_first_alone() -> None:
    axis = LinearAxis(lambda _a: BEST, SETTINGS)
    trailing, strokes = follow(learn_trailing(SETTINGS, LEARNED), axis)
    assert len(strokes) <= fast.ACCELERATIONS * (2 + fast.TRAILING_STROKES)
    assert {(round(s.pulse.duration_s, 9), round(s.pulse.amplitude_m_s, 9)) for s in strokes} == {
        (0.0, 0.0),
        (DURATION_S, AMPLITUDE_M_S),
    }
    for a, *_ in trailing:
        pulse = pulse_at(LEARNED._replace(trailing=trailing), a)
        with_it, without = (axis(Stroke("", a, p)) for p in (pulse, pulse_at(LEARNED, a)))
        assert evaluation_m(with_it, 0.3) <= 0.3 * evaluation_m(without, 0.3)


def test_the_second_trapezoid_is_never_worse_than_none() -> None:
    axis = LinearAxis(lambda _a: NO_PULSE, SETTINGS)  # any pulse makes it worse
    trailing, _ = follow(learn_trailing(SETTINGS, LEARNED), axis)
    for a, *_ in trailing:
        pulse = pulse_at(LEARNED._replace(trailing=trailing), a)
        with_it, without = (axis(Stroke("", a, p)) for p in (pulse, pulse_at(LEARNED, a)))
        assert evaluation_m(with_it, 0.16) <= evaluation_m(without, 0.16) * 1.001


def test_without_a_remaining_error_there_is_no_second_trapezoid() -> None:
    main = BEST._replace(trailing_start_s=0.0, trailing_duration_s=0.0, trailing_amplitude_m_s=0.0)
    trailing, strokes = follow(learn_trailing(SETTINGS, LEARNED), LinearAxis(lambda _a: main, SETTINGS))
    assert not np.array(trailing)[:, 3].any()
    assert len(strokes) == 2 * fast.ACCELERATIONS
