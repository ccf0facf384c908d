"""Values that the scope measures, against those of known signals."""

import numpy as np
import pytest
from stub_status import first_status

from servo_ctrl.hmi.link.row_ring import RowRing
from servo_ctrl.hmi.scope.appearance import ShownChannel
from servo_ctrl.hmi.scope.measurements import between, frequency_hz, line_of
from servo_ctrl.hmi.scope.stream import CapturedRows, clock_text
from servo_ctrl.hmi.shell.units import NO_VALUE, DisplayUnit

T = 1e-3
TIME_S = np.arange(2000) * T
SINE = 1.0 + 3.0 * np.sin(2.0 * np.pi * 12.5 * TIME_S + 0.4)
CHANNEL = ShownChannel("s", 0, DisplayUnit("N", 1.0, 3))


def test_a_sine_has_its_frequency_mean_and_rms() -> None:
    name, *texts, unit = line_of(CHANNEL, SINE, T)
    assert (name, unit, texts[-1]) == ("s", "N", "12.5 Hz")
    numbers = [float(text.replace("\N{MINUS SIGN}", "-")) for text in texts[:-1]]
    assert numbers == pytest.approx([-2.0, 4.0, 6.0, 1.0, np.sqrt(1.0 + 4.5)], abs=2e-3)


def test_noise_around_the_mean_is_no_frequency_and_rest_has_none() -> None:
    noisy = SINE + np.random.default_rng(1).normal(0.0, 0.1, len(SINE))
    assert frequency_hz(noisy, T) == pytest.approx(12.5, rel=0.01)
    assert frequency_hz(np.ones(50), T) == frequency_hz(np.zeros(0), T) == 0.0
    assert frequency_hz(np.linspace(0.0, 1.0, 50), T) == 0.0


def test_cycles_without_a_value_are_left_out() -> None:
    values = SINE.copy()
    values[::7] = np.nan
    assert line_of(CHANNEL, values, T)[-2] == "12.5 Hz"
    assert line_of(CHANNEL, np.full(3, np.nan), T)[1:-1] == [NO_VALUE] * 6


def test_both_cursors_bound_what_is_measured_whichever_comes_first() -> None:
    rows = CapturedRows(100, np.arange(50.0).reshape(-1, 1))
    part = between(rows, 120, {"A": 5 * T, "B": -5 * T}, T)
    assert part[:, 0].tolist() == list(range(15, 26))
    assert len(between(rows, 120, {"A": 0.0}, T)) == 50
    assert between(rows, 120, {"A": -90 * T, "B": -80 * T}, T).size == 0


def test_time_zero_has_its_clock_time() -> None:
    ring = RowRing(("cycle",), 100)
    ring.extend(np.arange(1000.0, 1050.0).reshape(-1, 1))
    status = first_status()._replace(cycles=1050, time="2026-11-24T09:30:01.050+00:00")
    texts = [clock_text(status, ring, origin, T) for origin in (0, 10, 50)]
    assert [text[-6:] for text in texts] == ["01.000", "01.010", "01.050"]
    assert clock_text(None, ring, 0, T) == clock_text(status._replace(time=""), ring, 0, T) == ""
