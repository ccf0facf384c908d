"""Effects of the precision stage on positioning: lead error, lost motion, structural vibration."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil_sim.config import build_plant, load_plant
from hil_sim.plant import amplifier
from hil_sim.plant.integrate import advance
from hil_sim.plant.measured_point import measured_point_m

CONFIG = load_plant(Path(__file__).parents[3] / "machines" / "precision_stage")
EFFECTS = CONFIG.axes["x"].effects
ARM = EFFECTS["structural_mode"]
DISTANCE_M, SPEED_M_S = 20e-3, 0.05


def ramp(rise_s: float, jerk_s: float) -> Any:
    """Position (n,) every millisecond: boxes of acceleration, each widened by a moving mean of `jerk_s`."""
    rise, cruise = round(rise_s * 1e3), round(DISTANCE_M / SPEED_M_S * 1e3)
    acceleration = np.zeros(rise + cruise)
    acceleration[:rise] = SPEED_M_S / rise_s
    acceleration[cruise:] -= SPEED_M_S / rise_s
    width = max(1, round(jerk_s * 1e3))
    acceleration = np.convolve(acceleration, np.full(width, 1.0 / width))
    position = np.cumsum(np.cumsum(acceleration)) * 1e-6
    return DISTANCE_M * position / position[-1]


class Stage:
    def __init__(self) -> None:
        self.plant = build_plant(CONFIG)
        self.plant.setpoint["loop"] = amplifier.POSITION
        self.zero_m = self.point_m()

    def point_m(self) -> float:
        return measured_point_m(self.plant.params[0], self.plant.state[0])

    def follow(self, position_m: Any) -> Any:
        """Where the measured point is after every millisecond (m)."""
        points = []
        for target_m in position_m:
            self.plant.setpoint["position_m"] = target_m
            advance(*self.plant, 20, CONFIG.dt_s)
            points.append(self.point_m() - self.zero_m)
        return np.array(points)


def test_jumps_of_acceleration_leave_it_swinging_and_ramps_do_not() -> None:
    left_um = []
    for jerk_s in (1e-3, 0.1):
        stage, path = Stage(), ramp(0.1, jerk_s)
        stage.follow(path)
        after = stage.follow(np.full(1000, path[-1]))
        left_um.append([np.ptp(after[part : part + 50]) / 2.0 * 1e6 for part in (100, 500, 950)])
    jumps, ramps = left_um
    assert 1.0 < jumps[0] < 2.0 * SPEED_M_S / 0.1 / (2.0 * math.pi * ARM.frequency_hz) ** 2 * 1e6
    assert jumps[0] > jumps[1] > jumps[2] > 0.1
    assert ramps[0] < 0.05 * jumps[0]


@pytest.fixture(scope="module")
def there_and_back_um() -> Any:
    """Error (um) of the point at -60 ... 60 mm, coming from below (first row) and from above."""
    stage, stops_m = Stage(), np.array([-60.0, -20.0, 20.0, 60.0]) * 1e-3
    at_m, rows = 0.0, []
    for stops in (stops_m, stops_m[::-1]):
        side = math.copysign(5e-3, stops[-1])
        row = []
        for target_m in (stops[0] - side, *stops, stops[-1] + side):
            steps = max(200, round(abs(target_m - at_m) / SPEED_M_S * 1e3))
            passed = np.arange(1, 1 + steps) / steps
            blend = passed**3 * (10.0 - 15.0 * passed + 6.0 * passed**2)  # without a jump of acceleration
            stage.follow(at_m + (target_m - at_m) * blend)
            after = stage.follow(np.full(200, target_m))
            at_m = float(target_m)
            row.append((after[-25:].mean() - target_m) * 1e6)
        rows.append(row[1:-1])
    return np.array([rows[0], rows[1][::-1]])


def test_lead_of_the_screw_is_the_slope_of_the_error(there_and_back_um: Any) -> None:
    """At stops a whole number of turns apart the wobble is the same everywhere."""
    slope_um_mm = np.polyfit([-60.0, -20.0, 20.0, 60.0], there_and_back_um.mean(axis=0), 1)[0]
    cumulative = EFFECTS["lead_error_cumulative"].relative_error * 1e3
    assert slope_um_mm == pytest.approx(cumulative, rel=0.05)


def test_reversal_is_the_play_and_the_wind_up_under_friction(there_and_back_um: Any) -> None:
    lost_um = there_and_back_um[1] - there_and_back_um[0]
    play_um = 2.0 * EFFECTS["backlash"].play_m * 1e6
    wind_up_um = 2.0 * EFFECTS["coulomb_friction"].coulomb_n / EFFECTS["drive_compliance"].stiffness_n_m * 1e6
    assert (lost_um > play_um).all()
    assert (lost_um < play_um + 2.0 * wind_up_um).all()
