"""The notch against scipy's filters: coefficients, samples, response; and in the tick."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.tick import axis_tick, initial_state
from servo_ctrl.control.types import AxisSample, Output
from servo_ctrl.errors import ConfigError

CASES = pytest.mark.parametrize(
    ("frequency_hz", "damping_ratio", "depth", "period_s"),
    [(40.0, 0.5, 0.1, 1e-3), (180.0, 0.2, 0.0, 1e-3), (20.0, 1.0, 0.3, 4e-3), (490.0, 0.7, 0.05, 1e-3)],
)


def scipy_notch(
    frequency_hz: float, damping_ratio: float, depth: float, period_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """By scipy's bilinear transform of the analogue filter, prewarped: 2 fs tan(w / 2 fs) in place of w."""
    w = 2.0 / period_s * math.tan(math.pi * frequency_hz * period_s)
    zeros, poles = ([1.0, 2.0 * damping_ratio * share * w, w * w] for share in (depth, 1.0))
    return signal.bilinear(zeros, poles, 1.0 / period_s)


def passed(p: notch.Params, values: np.ndarray) -> list[float]:
    state, out = notch.at_rest(), []
    for value in values.tolist():
        output, state = notch.notched(p, state, value)
        out.append(output)
    return out


@CASES
def test_it_filters_as_scipy_does(
    frequency_hz: float, damping_ratio: float, depth: float, period_s: float
) -> None:
    p = notch.biquad(frequency_hz, damping_ratio, depth, period_s)
    b, a = scipy_notch(frequency_hz, damping_ratio, depth, period_s)
    assert_allclose([p.b0, p.b1, p.b2], b, rtol=1e-12)
    assert_allclose([1.0, p.b1, p.a2], a, rtol=1e-12)
    values = np.random.default_rng(1).normal(size=2000)
    assert_allclose(passed(p, values), signal.lfilter(b, a, values), atol=1e-10)


@CASES
def test_its_depth_is_at_its_frequency_and_nothing_changes_at_rest(
    frequency_hz: float, damping_ratio: float, depth: float, period_s: float
) -> None:
    p = notch.biquad(frequency_hz, damping_ratio, depth, period_s)
    _, response = signal.freqz(
        [p.b0, p.b1, p.b2], [1.0, p.b1, p.a2], worN=[0.0, frequency_hz], fs=1.0 / period_s
    )
    assert_allclose(np.abs(response), [1.0, depth], atol=1e-9)


@pytest.mark.parametrize("output", [Output.FORCE, Output.VELOCITY])
def test_in_the_tick_it_filters_what_goes_to_the_amplifier(machines: Path, output: Output) -> None:
    plain = axis_params(load_machine(machines / "xy_table"), "x")._replace(output=int(output))
    filtered = plain._replace(notch=notch.biquad(60.0, 0.5, 0.1, plain.period_s))
    rng, commands = np.random.default_rng(2), []
    samples = [AxisSample(1e-5 * x, 0.0, 0.0, 0.0, 0.0, 0.0, math.nan) for x in rng.normal(size=300).tolist()]
    for params in (plain, filtered):
        state, rows = initial_state(0.0), []
        for sample in samples:
            state, command = axis_tick(params, state, sample)
            rows.append(command.force_n if output is Output.FORCE else command.velocity_m_s)
        commands.append(np.array(rows))
    assert_allclose(commands[1], passed(filtered.notch, commands[0]), rtol=1e-12)


def test_it_keeps_its_state_through_a_bad_sample_and_holds_the_limit(machines: Path) -> None:
    plain = axis_params(load_machine(machines / "xy_table"), "x")
    params = plain._replace(notch=notch.biquad(60.0, 0.1, 0.0, plain.period_s))
    state, force = initial_state(0.0), []
    for k in range(200):
        wave_m = 3e-3 * (1.0 if k // 8 % 2 else -1.0)
        state, command = axis_tick(params, state, AxisSample(wave_m, 0.0, 0.0, 0.0, 0.0, 0.0, math.nan))
        force.append(abs(command.force_n))
    after, _ = axis_tick(params, state, AxisSample(0.0, 0.0, 0.0, 0.0, math.nan, 0.0, math.nan))
    assert after.notch == state.notch
    assert max(force) == params.limits.force_n


def test_a_frequency_that_the_set_points_cannot_carry_is_refused(machines: Path, tmp_path: Path) -> None:
    text = (machines / "xy_table" / "controller.toml").read_text(encoding="utf-8")
    file = tmp_path / "controller.toml"
    file.write_text(text + "\n[axis.x.notch]\nfrequency_hz = 500.0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"axis\.x\.notch\.frequency_hz: 500 Hz is not below half"):
        load_machine(file)
