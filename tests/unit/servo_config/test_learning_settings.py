"""From the machine file to learning: settings in SI, and the motion of a stroke."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.learning import learning_settings, stroke_steps
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import program_segments
from servo_ctrl.errors import ConfigError
from servo_ctrl.learning.performance import reversals
from servo_ctrl.learning.schedule import stroke_s
from servo_ctrl.learning.stroke_result import stroke_result, trace_samples
from servo_ctrl.learning.types import NO_PULSE, LearningSettings, Stroke
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.sine import Sine

SECTION = """[learning]
learner = "paper"
radius_mm = 20.0
accelerations_mm_s2 = [3.0, 8.0, 30.0, 90.0]
steps = [1, 2, 3]
coarse_steps = 11
fine_steps = 7
initial_share = 0.15
duration_step_ms = 8.0
duration_reach = 1.7
window_durations = 3.0
trailing = false
"""


def commands(machine: MachineConfig, stroke: Stroke, start_m: list[float]) -> np.ndarray:
    """Position and acceleration command (n, 2) of the learning axis, and of the other axis."""
    steps = stroke_steps(machine, "y", stroke, start_m)
    parts = program_segments(steps, machine, start_m)
    return np.concatenate(
        [
            np.stack([part.position_m[:, 1], part.acceleration_m_s2[:, 1], part.position_m[:, 0]], 1)
            for part in parts
        ]
    )


def test_settings_are_those_of_the_file_in_si(spoilt: Callable[[str, str], Path]) -> None:
    path = spoilt("[learning]\n", SECTION)
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.index(SECTION)] + SECTION, encoding="utf-8")
    found = learning_settings(load_machine(path), "x")
    expected = LearningSettings(
        learner="paper",
        accelerations_m_s2=(0.003, 0.008, 0.03, 0.09),
        steps=(1, 2, 3),
        coarse_steps=11,
        fine_steps=7,
        initial_share=0.15,
        duration_step_s=0.008,
        duration_reach=1.7,
        window_durations=3.0,
        trailing=False,
        radius_m=0.02,
        amplitude_max_m_s=0.002,  # 100 mm/s^2 for 20 ms
        rise_s=0.02,
        window_s=0.2,
    )
    for name, value in expected._asdict().items():
        assert getattr(found, name) == (value if isinstance(value, str) else pytest.approx(value)), name


def test_the_requested_learner_overrides_that_of_the_file(table: MachineConfig) -> None:
    assert learning_settings(table, "x").learner == table.learning.learner == "fast"
    assert learning_settings(table, "x", "paper").learner == "paper"


def test_an_axis_without_a_pulse_has_nothing_to_learn(machines: Path) -> None:
    machine = load_machine(machines / "emps")
    (axis,) = machine.axes
    with pytest.raises(ConfigError, match=rf"axis\.{axis}\.friction_compensation.*no pulse to be learned"):
        learning_settings(machine, axis)


def test_an_axis_at_mid_travel_needs_no_approach(table: MachineConfig) -> None:
    (sine,) = stroke_steps(table, "y", Stroke("coarse", 0.03, NO_PULSE), [0.07, 0.0])
    assert isinstance(sine, Sine)
    assert (sine.label, sine.axis, sine.amplitude_m, sine.cycles) == ("coarse", 1, 0.05, 1.0)
    assert sine.amplitude_m * sine.speed_rad_s**2 == pytest.approx(0.03)


def test_an_axis_elsewhere_first_moves_to_mid_travel_and_the_others_stay(
    spoilt: Callable[[str, str], Path],
) -> None:
    machine = load_machine(spoilt("position_mm = [-100.0, 100.0]", "position_mm = [-60.0, 100.0]"))
    move, sine = stroke_steps(machine, "x", Stroke("coarse", 0.03, NO_PULSE), [-0.05, 0.04])
    assert isinstance(move, Move)
    assert move.to_m[0] == pytest.approx(0.02)
    assert math.isnan(move.to_m[1])
    assert move.feed_m_s <= machine.axes["x"].limits.velocity_mm_s * 1e-3
    assert isinstance(sine, Sine)


@pytest.mark.parametrize("acceleration_m_s2", [0.002, 0.0093, 0.12])
def test_a_stroke_reverses_twice_at_its_acceleration_within_the_predicted_time(
    table: MachineConfig, acceleration_m_s2: float
) -> None:
    settings = learning_settings(table, "y")
    stroke = Stroke("fine", acceleration_m_s2, NO_PULSE)
    motion = commands(table, stroke, [0.01, 0.0])
    starts = reversals(motion[:, 0])
    assert len(starts) == 2
    assert np.abs(motion[starts, 1]) == pytest.approx(acceleration_m_s2, rel=1e-3)
    assert np.abs(motion[:, 0]).max() == pytest.approx(settings.radius_m, rel=1e-6)
    assert (motion[:, 2] == 0.01).all()
    duration_s = len(motion) * table.period_s
    assert duration_s == pytest.approx(stroke_s(settings, acceleration_m_s2), rel=1e-3)
    result = stroke_result(motion[:, 0], motion[:, 0], stroke, settings, table.period_s)
    assert result.error_m.shape == (2, trace_samples(stroke, settings, table.period_s))
    assert not result.error_m.any()


def test_reversals_of_the_approach_are_not_counted_as_those_of_the_sine(table: MachineConfig) -> None:
    settings, stroke = learning_settings(table, "y"), Stroke("fine", 0.06, NO_PULSE)
    motion = commands(table, stroke, [0.0, 0.08])
    assert len(reversals(motion[:, 0])) == 3
    lag_m = motion[:, 0] - 2e-6 * np.sign(np.gradient(motion[:, 0]))
    result = stroke_result(motion[:, 0], lag_m, stroke, settings, table.period_s)
    assert result.error_m[:, 2:] == pytest.approx(2e-6)
