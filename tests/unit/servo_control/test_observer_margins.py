"""The observer's bandwidth on the X-Y table, by the linear procedure of docs/decisions/0007.

Sampled exactly: force held over a period, one period of bus, velocity from the last two positions. The
loops are broken where friction acts on the mass, behind the current that the observer measures.
"""

import math
import re
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize

from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params, with_observer
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.compensation.disturbance_observer import DisturbanceObserverSettings
from servo_ctrl.control.limits import AxisLimits
from servo_ctrl.control.loop_margins import open_loop
from servo_ctrl.control.section import filter_blend
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample

Response = NDArray[np.complex128]

REPOSITORY = Path(__file__).parents[3]
DOCUMENT = REPOSITORY / "docs" / "decisions" / "0007-disturbance-observer-bandwidth.md"
MACHINE = load_machine(REPOSITORY / "machines" / "xy_table")
PHASE_MARGIN_DEG = 40.0
SENSITIVITY_PEAK = 1.8
STEP_HZ = 0.5
FREQUENCY_HZ = np.geomspace(0.05, 499.0, 20_000)
SINES_HZ = np.array([0.5, 2.0, 5.0, 10.0, 20.0, 35.0, 50.0, 67.0, 90.0, 130.0, 200.0, 300.0, 450.0])


class Margins(NamedTuple):
    phase_margin_deg: float
    crossover_hz: float
    sensitivity_peak: float


def params_at(axis: str, bandwidth_hz: float, mass_share: float = 1.0) -> AxisParams:
    """The axis with an observer of this bandwidth, 0 = off, whose model has so much of the mass."""
    params = axis_params(MACHINE, axis)
    if bandwidth_hz == 0.0:
        return with_observer(params, enabled=False)
    blend = filter_blend(1.0 / (2.0 * math.pi * bandwidth_hz), params.period_s)
    observer = params.observer
    return params._replace(
        observer=observer._replace(enabled=True, filter_blend=blend, mass_kg=mass_share * observer.mass_kg)
    )


def margins(params: AxisParams, mass_kg: float) -> Margins:
    def size(frequency_hz: float) -> float:
        return abs(open_loop(params, mass_kg, np.array([frequency_hz]))[0]) - 1.0

    loop = open_loop(params, mass_kg, FREQUENCY_HZ)
    (crossing,) = np.flatnonzero((np.abs(loop[:-1]) >= 1.0) & (np.abs(loop[1:]) < 1.0))
    crossover = float(optimize.brentq(size, FREQUENCY_HZ[crossing], FREQUENCY_HZ[crossing + 1]))
    at_crossover = open_loop(params, mass_kg, np.array([crossover]))[0]
    return Margins(
        180.0 + math.degrees(float(np.angle(at_crossover))),
        crossover,
        float(np.abs(1.0 / (1.0 + loop)).max()),
    )


def mass_of(axis: str) -> float:
    observer = MACHINE.axes[axis].section(DisturbanceObserverSettings)
    assert observer is not None
    return observer.mass_kg


def at(axis: str, bandwidth_hz: float, mass_share: float = 1.0) -> Margins:
    return margins(params_at(axis, bandwidth_hz, mass_share), mass_of(axis))


def highest_bandwidth_hz() -> float:
    """The rule."""
    kept = 0.0
    while all(
        found.phase_margin_deg >= PHASE_MARGIN_DEG and found.sensitivity_peak <= SENSITIVITY_PEAK
        for found in (at(axis, kept + STEP_HZ) for axis in MACHINE.axes)
    ):
        kept += STEP_HZ
    return kept


@numba.njit
def _closed_loop(params: AxisParams, mass_kg: float, state: AxisState, load_n: Array, total_n: Array) -> None:
    # the exact motion of a mass under a force that is held over each period
    position_m = speed_m_s = acting_n = commanded_n = 0.0
    period_s = params.period_s
    for k in range(len(load_n)):
        state, command = axis_tick(
            params, state, AxisSample(0.0, 0.0, 0.0, 0.0, position_m, position_m, acting_n, 0.0)
        )
        acting_n, commanded_n = commanded_n, command.force_n
        total_n[k] = acting_n + load_n[k]
        a = total_n[k] / mass_kg
        position_m += speed_m_s * period_s + 0.5 * a * period_s**2
        speed_m_s += a * period_s


def measured_sensitivity(params: AxisParams, mass_kg: float) -> Response:
    """What the tick leaves of forces on the mass at `SINES_HZ`, all of them at once."""
    n = round(2.0 / params.period_s)  # every sine has whole cycles in it
    t = np.arange(4 * n) * params.period_s
    phases = np.arange(len(SINES_HZ)) ** 2.0
    load = np.cos(2.0 * math.pi * np.outer(t, SINES_HZ) + phases).sum(axis=1)
    total = np.empty_like(load)
    wide = params._replace(limits=AxisLimits(1e9, 1e9, 1e9))
    _closed_loop(wide, mass_kg, initial_state(0.0), load, total)
    bins = np.round(SINES_HZ * n * params.period_s).astype(int)
    left, put_in = np.fft.rfft(total[-n:])[bins], np.fft.rfft(load[-n:])[bins]
    return left / put_in


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("bandwidth_hz", [0.0, 3.0, 7.5, 20.0])
def test_the_tick_on_a_rigid_mass_has_the_sensitivity_of_the_linear_model(
    axis: str, bandwidth_hz: float
) -> None:
    params = params_at(axis, bandwidth_hz)
    expected = 1.0 / (1.0 + open_loop(params, mass_of(axis), SINES_HZ))
    np.testing.assert_allclose(measured_sensitivity(params, mass_of(axis)), expected, rtol=1e-5, atol=1e-7)


def test_the_sensitivity_agrees_for_another_model_mass_and_viscous_friction() -> None:
    params = params_at("x", 7.5, 1.3)
    params = params._replace(observer=params.observer._replace(viscous_n_s_m=200.0))
    expected = 1.0 / (1.0 + open_loop(params, 70.0, SINES_HZ))
    np.testing.assert_allclose(measured_sensitivity(params, 70.0), expected, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_without_the_observer_the_margins_are_those_of_the_calibration(axis: str) -> None:
    found = at(axis, 0.0)
    assert round(found.phase_margin_deg) == 46
    assert round(found.sensitivity_peak, 1) == 1.6


@pytest.mark.parametrize("bandwidth_hz", [0.0, 7.5])
def test_the_loop_becomes_unstable_where_the_linear_model_predicts(bandwidth_hz: float) -> None:
    # by the gain of the mass: half a mass is twice the loop gain of everything behind the break
    params = params_at("x", bandwidth_hz)
    limit = optimize.brentq(lambda share: critical(params, share * 70.0), 0.1, 0.9)
    load, total = np.zeros(8000), np.empty(8000)
    load[0] = 1.0
    wide = params._replace(limits=AxisLimits(1e9, 1e9, 1e9))
    largest = []
    for share in (1.03 * limit, 0.97 * limit):
        _closed_loop(wide, share * 70.0, initial_state(0.0), load, total)
        largest.append(np.abs(total[-1000:]).max())
    assert largest[0] < 1e-3
    assert largest[1] > 1e3


def critical(params: AxisParams, mass_kg: float) -> float:
    """How far the size of L is under 1 where its phase is -180 degrees; unstable below 0."""
    frequency = np.geomspace(20.0, 400.0, 20_000)
    loop = open_loop(params, mass_kg, frequency)
    crossing = np.flatnonzero((loop.imag[:-1] < 0.0) & (loop.imag[1:] >= 0.0))[0]
    return 1.0 - float(np.abs(loop[crossing]))


def test_the_machine_has_the_highest_bandwidth_that_the_rule_allows() -> None:
    found = highest_bandwidth_hz()
    for axis in MACHINE.axes.values():
        assert axis.section(DisturbanceObserverSettings) is not None
        assert axis.section(DisturbanceObserverSettings).bandwidth_hz == found


def test_the_figures_of_the_document_are_computed() -> None:
    rows = re.findall(
        r"^\| ([\d.]+) \|((?: [\d.]+ \|){5})$", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE
    )
    assert len(rows) >= 8
    for bandwidth, figures in rows:
        x, y = at("x", float(bandwidth)), at("y", float(bandwidth))
        assert figures.split("|")[:-1] == [
            f" {value} "
            for value in (
                f"{x.phase_margin_deg:.1f}",
                f"{x.sensitivity_peak:.2f}",
                f"{y.phase_margin_deg:.1f}",
                f"{y.sensitivity_peak:.2f}",
                f"{x.crossover_hz:.1f}",
            )
        ]
