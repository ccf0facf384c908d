"""Shaped set points against the closed form of a swing, and row by row as at once."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

from servo_ctrl.config.kernel_params import input_shaper
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.set_points.reference import ProgramReference, interleave
from servo_ctrl.daemon.set_points.set_point_source import SetPointSource
from servo_ctrl.motion.input_shaper import ShaperKind, impulses, shaped, taps
from servo_ctrl.motion.profile import MotionLimits
from servo_ctrl.motion.program import Move, segments

PERIOD_S = 1e-3
KINDS = pytest.mark.parametrize("kind", ["zv", "zvd"])


def residual(kind: ShaperKind, shaper_hz: float, swing_hz: float, damping: float) -> float:
    """Vibration behind the last impulse as a share of that without a shaper, by the closed form."""
    times_s, shares = impulses(kind, shaper_hz, damping)
    w = 2.0 * math.pi * swing_hz
    phasors = [
        share * np.exp((damping * w + 1j * w * math.sqrt(1.0 - damping**2)) * at)
        for at, share in zip(times_s, shares, strict=True)
    ]
    return float(abs(sum(phasors)) * math.exp(-damping * w * times_s[-1]))


def swing(command: np.ndarray, swing_hz: float, damping: float, from_row: int) -> float:
    """Amplitude of the oscillator that is left from this row on, scaled to an undamped one at that row."""
    w = 2.0 * math.pi * swing_hz
    system = signal.TransferFunction([w * w], [1.0, 2.0 * damping * w, w * w])
    time_s = np.arange(len(command)) * PERIOD_S
    _, place, _ = signal.lsim(system, command, time_s, interp=False)
    left = place[from_row:] - command[-1]
    rate = np.gradient(left, PERIOD_S)
    damped = w * math.sqrt(1.0 - damping**2)
    return float(np.hypot(left, (rate + damping * w * left) / damped)[2])


@KINDS
@pytest.mark.parametrize("damping", [0.0, 0.02, 0.2])
def test_at_its_frequency_nothing_is_left(kind: ShaperKind, damping: float) -> None:
    assert residual(kind, 40.0, 40.0, damping) < 1e-12
    assert_allclose(sum(impulses(kind, 40.0, damping)[1]), 1.0)


@KINDS
@pytest.mark.parametrize(("shaper_hz", "swing_hz"), [(40.0, 40.0), (40.0, 44.0), (25.0, 22.0), (31.7, 31.7)])
def test_a_swing_behind_a_step_is_that_of_the_closed_form(
    kind: ShaperKind, shaper_hz: float, swing_hz: float
) -> None:
    damping = 0.01
    shaper = taps(kind, shaper_hz, damping, PERIOD_S)
    step = np.zeros((400, 4))
    step[50:, 0] = 1e-3
    last = 50 + shaper.longest
    plain = swing(step[:, 0], swing_hz, damping, 50)
    left = swing(shaped(step, shaper)[:, 0], swing_hz, damping, last)
    decay = math.exp(
        -damping * 2.0 * math.pi * swing_hz * (impulses(kind, shaper_hz, damping)[0][-1] % PERIOD_S)
    )
    expected = residual(kind, shaper_hz, swing_hz, damping) * decay
    assert_allclose(left / plain, expected, atol=0.012)


def limits() -> MotionLimits:
    ones = np.ones(2)
    return MotionLimits(-ones, ones, 0.2 * ones, 2.0 * ones, 50.0 * ones, 100.0 * ones)


def test_the_cycle_gives_the_rows_that_the_twin_computes_at_once() -> None:
    start = np.array([0.01, -0.02])
    move = Move("move", (0.013, 0.03), 0.1, math.inf, False)
    (segment,) = segments([move], start, limits(), PERIOD_S)
    shapers = [taps("zvd", 37.3, 0.02, PERIOD_S), taps("zv", 21.0, 0.0, PERIOD_S)]
    source = SetPointSource([1.0, 1.0], PERIOD_S)
    source.shape(shapers)
    source.begin(ProgramReference(iter([segment])), start.tolist())
    rows, count = [], len(segment.position_m)
    for cycle in range(count):
        assert source.follow(cycle)
        rows.append(source.row)
    source.ramp_down([0.0, 0.0])
    while not source.at_rest:
        source.hold_or_ramp()
        rows.append(source.row)
    assert len(rows) - count <= max(one.longest for one in shapers) + 2
    wanted = np.array(interleave(segment)).reshape(count, 2, 4)
    wanted = np.concatenate((wanted, np.repeat(wanted[-1:], len(rows) - count, axis=0)))
    wanted[count:, :, 1:] = 0.0
    rest = np.zeros((1, 2, 4))
    rest[0, :, 0] = start
    wanted = np.concatenate((rest, wanted))
    for axis, shaper in enumerate(shapers):
        at_once = shaped(wanted[:, axis], shaper)[1:]
        assert np.array_equal(np.array(rows).reshape(-1, 2, 4)[:, axis], at_once)
        assert at_once[-1].tolist() == wanted[-1, axis].tolist()  # to the last bit at rest


def test_without_a_shaper_a_row_goes_out_as_it_is() -> None:
    source = SetPointSource([1.0], PERIOD_S)
    row = [0.1, 0.2, 0.3, 0.4]

    class One:
        ended, spans, step = False, [], 0

        def advance(self, _cycle: int) -> list[float]:
            return row

    source.begin(One(), [0.0])
    assert source.follow(0)
    assert source.row is row


def test_shaped_set_points_keep_the_limits() -> None:
    values = np.random.default_rng(3).uniform(-1.0, 1.0, (500, 4))
    out = shaped(values, taps("zvd", 53.0, 0.1, PERIOD_S))
    assert np.abs(out[:, 1:3]).max() <= 1.0
    assert np.array_equal(out[:, 3], values[:, 3])  # a force offset passes


def test_the_machine_file_has_it(machines: Path, tmp_path: Path) -> None:
    text = (machines / "xy_table" / "controller.toml").read_text(encoding="utf-8")
    file = tmp_path / "controller.toml"
    section = '\n[axis.x.input_shaper]\nkind = "zvd"\nfrequency_hz = 40.0\ndamping_ratio = 0.005\n'
    file.write_text(text.replace("../../eds", str(machines.parent / "eds")) + section, encoding="utf-8")
    machine = load_machine(file)
    assert input_shaper(machine, "x") == taps("zvd", 40.0, 0.005, 1e-3)
    assert input_shaper(machine, "y") is None
