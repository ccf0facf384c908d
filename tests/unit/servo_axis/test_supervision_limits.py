"""Limits of supervision, from a machine file's axis."""

import math
from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.axis.supervision import runaway_cycles, saturation_cycles, supervision_limits
from servo_ctrl.canopen.scaling import drive_scaling
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import AxisConfig

X = load_machine(Path(__file__).parents[3] / "machines" / "xy_table").axes["x"]


def axis_with(**limits: Any) -> AxisConfig:
    return X.model_copy(update={"limits": X.limits.model_copy(update=limits)})


def test_limits_of_the_table_are_shares_of_its_machine_file() -> None:
    """1 mm following error, 600 N, 0.43 N m/A on a lead of 10 mm, 2^20 counts a turn, 1 kHz."""
    found = supervision_limits(X, drive_scaling(X), 1e-3)
    assert found._asdict() == pytest.approx(
        {
            "deviation_m": 0.5e-3,
            "force_n": 600.0,
            "current_a": 0.98 * 600.0 * 0.01 / (2.0 * math.pi * 0.43),
            "push_n": 150.0,
            "error_m": 20e-6,
            "velocity_m_s": 2e-3 + 2.0 * 0.01 / 2**20 * 1000.0,
            "saturation_cycles": 500,
            "runaway_cycles": 5,
        },
        rel=1e-12,
    )


def test_configured_drift_is_used_unchanged() -> None:
    found = supervision_limits(axis_with(scale_deviation_mm=0.2), drive_scaling(X), 1e-3)
    assert found.deviation_m == pytest.approx(0.2e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("time_ms", "cycles"), [(0.1, (1, 3)), (3.0, (3, 3)), (3.2, (4, 4)), (40.0, (40, 40))]
)
def test_times_are_rounded_up_to_cycles_and_a_block_has_at_least_three(
    time_ms: float, cycles: tuple[int, int]
) -> None:
    axis = axis_with(saturation_ms=time_ms, runaway_ms=time_ms)
    assert (saturation_cycles(axis, 1e-3), runaway_cycles(axis, 1e-3)) == cycles
