"""The measured swing of a stage, and the input shaper in the positioning twin."""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hil_sim.config import load_plant
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.program import program_segments
from servo_ctrl.config.steps import program_steps
from servo_ctrl.motion.input_shaper import taps
from studies.twin_axis import set_points
from studies.wang_2014.plan import AT_100MM, plan_series, stage_machine
from studies.wang_2014.stages import STAGES
from studies.wang_2014.swing import measured_swing, swing_of
from studies.wang_2014.twin_study import Twin, powered_up, shaped_segments

STAGE = Path(__file__).parents[3] / "machines" / "precision_stage"
PERIOD_S, COUNT_M = 1e-3, 0.5e-6
MACHINE = stage_machine(STAGE, STAGES["s_curve_alone"])


def stage_with_arm(frequency_hz: float, without: tuple[str, ...] = ()) -> Twin:
    plant = load_plant(STAGE)
    axis = plant.axes["x"]
    arm = axis.effects["structural_mode"]._replace(frequency_hz=frequency_hz)
    effects = {name: effect for name, effect in axis.effects.items() if name not in without}
    slower = axis.model_copy(update={"effects": effects | {"structural_mode": arm}})
    return Twin(STAGE, plant.model_copy(update={"axes": {"x": slower}}))


@pytest.mark.parametrize(("frequency_hz", "damping_ratio"), [(28.3, 0.004), (40.0, 0.02), (51.7, 0.008)])
def test_a_swing_is_found_in_counts(frequency_hz: float, damping_ratio: float) -> None:
    time_s, w = np.arange(900) * PERIOD_S, 2.0 * math.pi * frequency_hz
    wave_m = 20e-6 * np.exp(-damping_ratio * w * time_s) * np.sin(w * time_s + 0.7)
    found = swing_of(3e-6 + COUNT_M * np.round(wave_m / COUNT_M), PERIOD_S)
    assert found.frequency_hz == pytest.approx(frequency_hz, abs=0.15)
    assert found.damping_ratio == pytest.approx(damping_ratio, rel=0.1)


def test_the_swing_of_a_stage_is_that_of_its_arm() -> None:
    twin = stage_with_arm(29.0)
    machine = stage_machine(STAGE, STAGES["uncompensated"])
    found = measured_swing(machine, powered_up(twin, machine, axis_params(machine, "x")).rollout)
    assert found.frequency_hz == pytest.approx(29.0, rel=0.01)
    assert 0.0 < found.damping_ratio < 0.02


def commands(kind: str | None) -> np.ndarray:
    """Set points (n, 4) of a cycle to 100 mm, segment after segment, as the twin gets them."""
    plan = plan_series(MACHINE, STAGES["s_curve_alone"], AT_100MM, 1)
    segments = program_segments(program_steps(plan.program, MACHINE), MACHINE, [0.0])
    shaper = None if kind is None else taps("zvd", 29.0, 0.005, MACHINE.period_s)
    return np.concatenate([points for _, points in shaped_segments(segments, 0, shaper)])


def test_segments_are_shaped_as_one_motion() -> None:
    """Against a sum of shifted copies of the whole motion."""
    plain, found = commands(None), commands("zvd")
    shaper = taps("zvd", 29.0, 0.005, MACHINE.period_s)
    expected = (1.0 - sum(shaper.shares)) * plain[:, :3]
    for delay, share in zip(shaper.delays, shaper.shares, strict=True):
        expected[delay:] += share * plain[: len(plain) - delay, :3]
    assert found[:, :3] == pytest.approx(expected, abs=1e-12)
    assert (found[:, 3] == plain[:, 3]).all()


def test_a_slow_arm_is_at_rest_after_a_shaped_move() -> None:
    """Without play and friction, whose own blow at the stop no set point takes away."""
    without = ("backlash", "presliding_gms", "coulomb_friction", "stribeck_friction")
    twin, left_m = stage_with_arm(29.0, without), []
    plan = plan_series(MACHINE, STAGES["s_curve_alone"], AT_100MM, 1)
    segments = list(program_segments(program_steps(plan.program, MACHINE), MACHINE, [0.0]))
    ends = np.cumsum([0, *(len(set_points(segment, 0)) for segment in segments)])
    rests = [
        span for span, segment in zip(pairwise(ends), segments, strict=True) if segment.step in plan.visits
    ]
    for kind in (None, "zvd"):
        rows = powered_up(twin, MACHINE, axis_params(MACHINE, "x")).rollout.rows(commands(kind))
        deflection_m = rows["scale_position_m"] - rows["motor_position_m"]
        left_m.append(max(amplitude_m(deflection_m[begin + 150 : begin + 598]) for begin, _ in rests))
    assert left_m[1] < 0.1 * left_m[0]


def amplitude_m(deflection_m: np.ndarray) -> float:
    """The amplitude at 29 Hz, of 13 cycles; what creeps is taken off."""
    time_s = np.arange(len(deflection_m)) * PERIOD_S
    swing_m = (deflection_m - np.polyval(np.polyfit(time_s, deflection_m, 2), time_s)) * np.hanning(
        len(time_s)
    )
    return float(4.0 * np.abs(np.mean(swing_m * np.exp(-2j * math.pi * 29.0 * time_s))))
